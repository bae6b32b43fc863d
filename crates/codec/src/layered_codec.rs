//! The planes of a layered image: how many samples each line has, and their depths.
//!
//! Samples are packed layer by layer: the first samples of all lines that have one, then the second ones. Neighbours of a layer
//! mostly belong to one surface, which is predicted as in a depth image.

use depth_image::MAX_LAYERS;

use crate::DecodeError;
use crate::depth_codec::{predict, restore};
use crate::tagged::{BLOCK, Packer, unpack, unzigzag, zigzag};

/// The places of samples in the order in which they are packed, for lines that begin at `first`.
pub(crate) fn layer_by_layer(first: &[u32]) -> Vec<u32> {
    let mut lines: Vec<[u32; 2]> = first.windows(2).map(|ends| [ends[0], ends[1]]).collect();
    let mut places = Vec::with_capacity(first.last().map_or(0, |&samples| samples as usize));
    loop {
        lines.retain(|[next, end]| next < end);
        if lines.is_empty() {
            return places;
        }
        places.extend(lines.iter().map(|[next, _]| next));
        lines.iter_mut().for_each(|[next, _]| *next += 1);
    }
}

/// The values of a plane at the places.
pub(crate) fn gather<T: Copy>(plane: &[T], places: &[u32]) -> Vec<T> {
    places.iter().map(|&place| plane[place as usize]).collect()
}

/// The inverse of [`gather`].
pub(crate) fn scatter<T: Copy + Default>(values: &[T], places: &[u32]) -> Vec<T> {
    let mut plane = vec![T::default(); places.len()];
    places.iter().zip(values).for_each(|(&place, &value)| plane[place as usize] = value);
    plane
}

/// Appends the number of samples of each line.
pub(crate) fn pack_layer_counts(first: &[u32], out: &mut Vec<u8>) {
    let counts: Vec<u16> = first.windows(2).map(|ends| (ends[1] - ends[0]) as u16).collect();
    pack_blocks(&counts, out, |counts, numbers| {
        let before = [0].iter().chain(counts);
        for ((number, &count), &before) in numbers.iter_mut().zip(counts).zip(before) {
            *number = zigzag(count.wrapping_sub(before));
        }
    });
}

/// The number of the first sample of each line, and after the last line that of all samples, which must be `samples`.
pub(crate) fn unpack_layer_counts(input: &mut &[u8], lines: usize, samples: usize) -> Result<Vec<u32>, DecodeError> {
    let counts = unpack_blocks(input, lines, |numbers| {
        let mut count = 0u16;
        for number in numbers {
            count = count.wrapping_add(unzigzag(*number));
            *number = count;
        }
    })?;
    if counts.iter().any(|&count| u32::from(count) > MAX_LAYERS) {
        return Err(DecodeError::Corrupt { field: "layer_count", reason: "more than 255" });
    }
    let mut next = 0;
    let ends = counts.iter().map(|&count| {
        next += u32::from(count);
        next
    });
    let first: Vec<u32> = std::iter::once(0).chain(ends).collect();
    if next as usize != samples {
        return Err(DecodeError::Corrupt { field: "layer_count", reason: "not as many as the header says" });
    }
    Ok(first)
}

/// Appends depths as codes of 16 bits, linear from 0 to `range_m`.
pub(crate) fn pack_depths(planar_depth_m: &[f32], range_m: f32, out: &mut Vec<u8>) {
    let codes_per_m = f64::from(u16::MAX) / f64::from(range_m);
    // A cast saturates.
    let codes: Vec<u16> =
        planar_depth_m.iter().map(|&depth_m| (f64::from(depth_m) * codes_per_m).round() as u16).collect();
    pack_blocks(&codes, out, predict);
}

/// Depths from 0 to `range_m`.
pub(crate) fn unpack_depths(input: &mut &[u8], samples: usize, range_m: f32) -> Result<Vec<f32>, DecodeError> {
    let codes = unpack_blocks(input, samples, restore)?;
    let step_m = f64::from(range_m) / f64::from(u16::MAX);
    Ok(codes.into_iter().map(|code| ((f64::from(code) * step_m) as f32).min(range_m)).collect())
}

fn pack_blocks(values: &[u16], out: &mut Vec<u8>, residuals: impl Fn(&[u16], &mut [u16])) {
    let mut packer = Packer::new(values.len());
    for block in values.chunks(BLOCK) {
        packer.pack(block.len(), out, |numbers| residuals(block, numbers));
    }
}

fn unpack_blocks(input: &mut &[u8], count: usize, values: impl Fn(&mut [u16])) -> Result<Vec<u16>, DecodeError> {
    let mut numbers = vec![0; count];
    for block in numbers.chunks_mut(BLOCK) {
        unpack(input, block)?;
        values(block);
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tagged::max_packed_bytes;
    use crate::test_support::Random;

    #[test]
    fn samples_go_layer_by_layer_and_come_back() {
        assert_eq!(layer_by_layer(&[0, 2, 2, 3, 6]), [0, 2, 3, 1, 4, 5]);
        assert_eq!(layer_by_layer(&[0]), [0; 0]);
        let places = layer_by_layer(&[0, 2, 2, 3, 6]);
        let plane = [10, 11, 12, 13, 14, 15];
        assert_eq!(scatter(&gather(&plane, &places), &places), plane);
    }

    #[test]
    fn counts_survive_and_others_are_refused() {
        let mut random = Random::new(21);
        for lines in [0, 1, 3, 1000, BLOCK + 5] {
            let mut first = vec![0];
            (0..lines).for_each(|line| first.push(first[line] + random.below(256) as u32));
            let samples = first[lines] as usize;
            let mut bytes = Vec::new();
            pack_layer_counts(&first, &mut bytes);
            assert!(bytes.len() <= max_packed_bytes(lines));
            assert_eq!(unpack_layer_counts(&mut &bytes[..], lines, samples), Ok(first));
            assert!(unpack_layer_counts(&mut &bytes[..], lines, samples + 1).is_err());
        }
        let mut bytes = Vec::new();
        pack_layer_counts(&[0, 256], &mut bytes);
        let more = Err(DecodeError::Corrupt { field: "layer_count", reason: "more than 255" });
        assert_eq!(unpack_layer_counts(&mut &bytes[..], 1, 256), more);
    }

    #[test]
    fn depths_come_back_within_half_a_code() {
        let mut random = Random::new(22);
        let range_m = 7.3;
        let depths: Vec<f32> = (0..BLOCK + 9).map(|_| range_m * random.below(100_001) as f32 / 100_000.0).collect();
        let mut bytes = Vec::new();
        pack_depths(&depths, range_m, &mut bytes);
        assert!(bytes.len() <= max_packed_bytes(depths.len()));
        let back = unpack_depths(&mut &bytes[..], depths.len(), range_m).unwrap();
        let most_m = 0.51 * range_m / f32::from(u16::MAX);
        assert!(depths.iter().zip(&back).all(|(a, b)| (a - b).abs() <= most_m && *b <= range_m));
    }

    #[test]
    fn damaged_planes_behind_a_sound_lz4_never_panic() {
        let mut random = Random::new(23);
        let mut first = vec![0];
        (0..600).for_each(|line| first.push(first[line] + random.below(6) as u32));
        let samples = first[600] as usize;
        let depths: Vec<f32> = (0..samples).map(|_| random.unit() * 5.0).collect();
        let [mut counts, mut codes] = [Vec::new(), Vec::new()];
        pack_layer_counts(&first, &mut counts);
        pack_depths(&depths, 5.0, &mut codes);
        let mut damaged = |good: &[u8]| {
            let mut bytes = good.to_vec();
            let at = random.below(bytes.len());
            bytes[at] = random.next_u32() as u8;
            bytes.truncate(if random.below(4) == 0 { random.below(bytes.len()) } else { bytes.len() });
            bytes
        };
        for _ in 0..3000 {
            let first = unpack_layer_counts(&mut &damaged(&counts)[..], 600, samples);
            assert!(first.is_err() || first.is_ok_and(|first| first.is_sorted() && first[600] as usize == samples));
            let depths = unpack_depths(&mut &damaged(&codes)[..], samples, 5.0);
            assert!(depths.is_err() || depths.is_ok_and(|depths| depths.iter().all(|d| (0.0..=5.0).contains(d))));
        }
    }
}
