//! The places of samples: runs of holes, of background and of samples, row after row.
//!
//! Each run is 16 bits, kind in the lowest two. Other planes of an image are empty where there is no sample: only their
//! samples are stored, and these runs spread them out again.

use crate::DecodeError;
use crate::quantise::{BACKGROUND_CODE, FIRST_SAMPLE_CODE, HOLE_CODE};
use crate::tagged::{take, take_array};

const LONGEST: usize = (u16::MAX >> 2) as usize;

/// Texels of one kind in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    /// [`HOLE_CODE`], [`BACKGROUND_CODE`] or [`FIRST_SAMPLE_CODE`].
    pub kind: u16,
    /// Consecutive texels, at least 1.
    pub texels: usize,
}

/// The runs of a whole plane, and the count of samples in them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Runs {
    runs: Vec<Run>,
    sample_count: usize,
}

impl Runs {
    /// Adds the runs of more codes, and their samples to `samples`.
    pub fn extend(&mut self, codes: &[u16], samples: &mut Vec<u16>) {
        let mut rest = codes;
        while let Some(&first) = rest.first() {
            let kind = first.min(FIRST_SAMPLE_CODE);
            let texels = if kind == FIRST_SAMPLE_CODE {
                leading(rest, |code| code >= FIRST_SAMPLE_CODE)
            } else {
                leading(rest, |code| code == kind)
            };
            let (here, after) = rest.split_at(texels);
            if kind == FIRST_SAMPLE_CODE {
                samples.extend_from_slice(here);
                self.sample_count += texels;
            }
            self.push(Run { kind, texels });
            rest = after;
        }
    }

    fn push(&mut self, run: Run) {
        match self.runs.last_mut().filter(|last| last.kind == run.kind) {
            Some(last) => last.texels += run.texels,
            None => self.runs.push(run),
        }
    }

    /// Appends the length in bytes, then the runs.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&(self.written_bytes() as u32 - 4).to_le_bytes());
        for run in &self.runs {
            let mut left = run.texels;
            while left > 0 {
                let texels = left.min(LONGEST);
                out.extend_from_slice(&(run.kind | (texels as u16) << 2).to_le_bytes());
                left -= texels;
            }
        }
    }

    /// Bytes that [`Runs::write`] appends.
    pub fn written_bytes(&self) -> usize {
        4 + 2 * self.runs.iter().map(|run| run.texels.div_ceil(LONGEST)).sum::<usize>()
    }

    /// Reads the runs of a plane of `texels` from the front of `input`.
    pub fn read(input: &mut &[u8], texels: usize) -> Result<Self, DecodeError> {
        let length = u32::from_le_bytes(take_array(input)?);
        // `take` refuses a length beyond the input before anything of that size is allocated.
        let (words, odd) = take(input, length as usize)?.as_chunks::<2>();
        if !odd.is_empty() {
            return Err(DecodeError::Corrupt { field: "runs", reason: "odd number of bytes" });
        }
        let words = words.iter().map(|&word| u16::from_le_bytes(word));
        let runs: Vec<Run> = words.map(|word| Run { kind: word & 3, texels: usize::from(word >> 2) }).collect();
        if runs.iter().any(|run| run.texels == 0 || run.kind > FIRST_SAMPLE_CODE) {
            return Err(DecodeError::Corrupt { field: "runs", reason: "empty run or unknown kind" });
        }
        if runs.iter().map(|run| run.texels).sum::<usize>() != texels {
            return Err(DecodeError::Corrupt { field: "runs", reason: "do not fill the plane" });
        }
        let sample_count = runs.iter().filter(|run| run.kind == FIRST_SAMPLE_CODE).map(|run| run.texels).sum();
        Ok(Self { runs, sample_count })
    }

    /// Most bytes that [`Runs::write`] appends for a plane of `texels`.
    pub const fn max_bytes(texels: usize) -> usize {
        4 + texels * 2
    }

    /// Texels with a sample.
    pub fn sample_count(&self) -> usize {
        self.sample_count
    }

    /// The samples of a plane, close together.
    pub fn gather<T: Copy>(&self, plane: &[T]) -> Vec<T> {
        let mut samples = Vec::with_capacity(self.sample_count);
        let mut rest = plane;
        for run in &self.runs {
            let (here, after) = rest.split_at(run.texels);
            if run.kind == FIRST_SAMPLE_CODE {
                samples.extend_from_slice(here);
            }
            rest = after;
        }
        samples
    }

    /// The inverse of [`Runs::gather`]; `empty` where there is no sample.
    pub fn scatter<T: Copy>(&self, samples: &[T], empty: T) -> Vec<T> {
        let texels = self.runs.iter().map(|run| run.texels).sum();
        let mut plane = vec![empty; texels];
        self.scatter_with(&mut plane, samples, |samples, out| out.copy_from_slice(samples), |_, _| ());
        plane
    }

    /// Walks a plane run by run: `on_samples` gets the samples of a run and their place, `on_empty` the
    /// kind and place of a run without.
    pub fn scatter_with<S, T>(
        &self,
        plane: &mut [T],
        samples: &[S],
        mut on_samples: impl FnMut(&[S], &mut [T]),
        mut on_empty: impl FnMut(u16, &mut [T]),
    ) {
        let mut plane = plane;
        let mut samples = samples;
        for run in &self.runs {
            let (place, after) = plane.split_at_mut(run.texels);
            plane = after;
            if run.kind == FIRST_SAMPLE_CODE {
                let (here, later) = samples.split_at(run.texels);
                on_samples(here, place);
                samples = later;
            } else {
                on_empty(run.kind, place);
            }
        }
    }
}

/// The count of codes at the front that hold a property. Whole blocks are tested at once.
fn leading(codes: &[u16], holds: impl Fn(u16) -> bool) -> usize {
    const BLOCK: usize = 32;
    let (blocks, _) = codes.as_chunks::<BLOCK>();
    let full = blocks.iter().take_while(|block| block.iter().fold(true, |all, &code| all & holds(code)));
    let whole = full.count() * BLOCK;
    whole + codes[whole..].iter().take_while(|&&code| holds(code)).count()
}

const _: () = assert!(HOLE_CODE < BACKGROUND_CODE && BACKGROUND_CODE < FIRST_SAMPLE_CODE);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_survive_and_gather_inverts_scatter() {
        let mut codes = vec![0, 0, 1, 7, 8, 9, 1, 1, 3];
        codes.extend(std::iter::repeat_n(1, LONGEST * 2 + 5));
        codes.extend(std::iter::repeat_n(500, 1000));
        let mut runs = Runs::default();
        let mut found = Vec::new();
        codes.chunks(1001).for_each(|codes| runs.extend(codes, &mut found));
        assert_eq!(runs.sample_count(), 1004);
        let mut bytes = Vec::new();
        runs.write(&mut bytes);
        let back = Runs::read(&mut &bytes[..], codes.len()).expect("own runs");
        let samples = runs.gather(&codes);
        assert_eq!(found, samples);
        assert_eq!(samples[..5], [7, 8, 9, 3, 500]);
        let spread = back.scatter(&samples, 0);
        assert!(spread.iter().zip(&codes).all(|(&a, &b)| a == if b >= 2 { b } else { 0 }));
    }

    #[test]
    fn runs_that_do_not_fill_the_plane_are_refused() {
        let mut bytes = Vec::new();
        let mut runs = Runs::default();
        runs.extend(&[5; 100], &mut Vec::new());
        runs.write(&mut bytes);
        assert!(Runs::read(&mut &bytes[..], 100).is_ok());
        assert!(Runs::read(&mut &bytes[..], 99).is_err());
        assert!(Runs::read(&mut &bytes[..], 101).is_err());
        assert!(Runs::read(&mut &bytes[..5], 100).is_err());
        assert!(Runs::read(&mut &[255, 255, 255, 255, 0][..], 100).is_err());
    }
}
