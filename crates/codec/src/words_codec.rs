//! Planes of 32-bit words, without loss: differences along the row, packed by class.
//!
//! LZ4 alone finds only what repeats to the bit. Differences of neighbours are small where a surface is
//! smooth and nothing where it is flat.
//!
//! Bytes of words of four parts, as a share of LZ4 alone, by the `depth_codec_bench` example:
//!
//! | | 400×300 | 1024² |
//! |---|---|---|
//! | two materials, one of uneven roughness | 0.49 | 0.47 |
//! | visibility of four lights, 256 rays | 0.49 | 0.46 |
//! | visibility, 16 rays | 0.82 | 0.80 |
//! | visibility, hard shadows | 0.83 | 0.80 |
//!
//! Packed as halves, uneven roughness takes twice as much, and visibility by 256 rays two fifths more. Byte planes before
//! LZ4 are a tenth smaller by 16 rays and a sixth larger by 256.

use crate::DecodeError;
use crate::tagged::{BLOCK, Packer, max_packed_bytes, unpack, unzigzag, zigzag};

/// The parts of a word. Each part is a stream of its own, so that a part that changes much does not widen the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WordLayout {
    /// One number of 32 bits, sent as two halves.
    Whole,
    /// Two numbers of 16 bits, as in octahedral normals.
    Halves,
    /// Two numbers of 8 bits in the lower half, as in octahedral normals of triangles.
    TwoBytes,
    /// Four numbers of 8 bits, as in reflectance and visibility.
    Bytes,
}

impl WordLayout {
    /// Streams of a plane.
    const fn parts(self) -> usize {
        match self {
            Self::Whole | Self::Halves | Self::TwoBytes => 2,
            Self::Bytes => 4,
        }
    }

    /// The bit at which a part begins in its word.
    const fn shift(self, part: usize) -> usize {
        match self {
            Self::Whole | Self::Halves => 16 * part,
            Self::TwoBytes | Self::Bytes => 8 * part,
        }
    }
}

/// Most bytes that [`pack_words`] appends for `count` words.
pub(crate) const fn max_words_bytes(count: usize, layout: WordLayout) -> usize {
    layout.parts() * max_packed_bytes(count)
}

/// Appends `words` to `out`.
pub(crate) fn pack_words(words: &[u32], layout: WordLayout, out: &mut Vec<u8>) {
    let mut packer = Packer::new(words.len());
    for block in words.chunks(BLOCK) {
        for part in 0..layout.parts() {
            packer.pack(block.len(), out, |numbers| differences(block, layout, layout.shift(part), numbers));
        }
    }
}

#[inline]
fn differences(words: &[u32], layout: WordLayout, shift: usize, out: &mut [u16]) {
    match layout {
        // Not by `shift`: packing with a known shift takes a quarter less time.
        WordLayout::Whole if shift == 0 => for_neighbours(words, out, |word, last| whole_difference(word, last) as u16),
        WordLayout::Whole => for_neighbours(words, out, |word, last| (whole_difference(word, last) >> 16) as u16),
        WordLayout::Halves => for_neighbours(words, out, |word, last| {
            zigzag(((word >> shift) as u16).wrapping_sub((last >> shift) as u16))
        }),
        WordLayout::TwoBytes | WordLayout::Bytes => for_neighbours(words, out, |word, last| {
            let difference = ((word >> shift) as u8).wrapping_sub((last >> shift) as u8);
            zigzag(difference as i8 as u16)
        }),
    }
}

/// Applies `number` to each word and the one before, which is 0 before the first.
#[inline]
pub(crate) fn for_neighbours(words: &[u32], out: &mut [u16], number: impl Fn(u32, u32) -> u16) {
    let Some((first, others)) = out.split_first_mut() else { return };
    *first = number(words[0], 0);
    for ((out, &last), &word) in others.iter_mut().zip(words).zip(&words[1..]) {
        *out = number(word, last);
    }
}

/// Reads `count` words from the front of `input`.
pub(crate) fn unpack_words(input: &mut &[u8], count: usize, layout: WordLayout) -> Result<Vec<u32>, DecodeError> {
    let mut words: Vec<u32> = Vec::with_capacity(count);
    let mut numbers = vec![0; layout.parts() * count.min(BLOCK)];
    while words.len() < count {
        let block = (count - words.len()).min(BLOCK);
        let numbers = &mut numbers[..layout.parts() * block];
        for part in numbers.chunks_exact_mut(block) {
            unpack(input, part)?;
        }
        let start = words.len();
        extend_by_changes(&mut words, numbers, block, layout);
        sum_up(&mut words[start..], layout);
    }
    Ok(words)
}

/// Appends the change of each word of a block; `numbers` holds the block's parts one after the other. All but the sums,
/// which wait for each other, is done for many words at once.
fn extend_by_changes(words: &mut Vec<u32>, numbers: &[u16], block: usize, layout: WordLayout) {
    let (low, high) = numbers.split_at(numbers.len() / 2);
    match layout {
        WordLayout::Whole => words.extend(low.iter().zip(high).map(|(&low, &high)| {
            let number = u32::from(low) | u32::from(high) << 16;
            (number >> 1) ^ (number & 1).wrapping_neg()
        })),
        WordLayout::Halves => words.extend(
            low.iter().zip(high).map(|(&low, &high)| u32::from(unzigzag(low)) | u32::from(unzigzag(high)) << 16),
        ),
        WordLayout::TwoBytes => words.extend(low.iter().zip(high).map(|(&low, &high)| two_bytes(low, high))),
        WordLayout::Bytes => {
            let (a, b) = low.split_at(block);
            let (c, d) = high.split_at(block);
            let lows = a.iter().zip(b).map(|(&a, &b)| two_bytes(a, b));
            let highs = c.iter().zip(d).map(|(&c, &d)| two_bytes(c, d));
            words.extend(lows.zip(highs).map(|(low, high)| low | high << 16));
        }
    }
}

#[inline]
fn two_bytes(low: u16, high: u16) -> u32 {
    u32::from(unzigzag(low) as u8) | u32::from(unzigzag(high) as u8) << 8
}

/// Words from their changes to the one before, which is 0 before the first.
fn sum_up(changes: &mut [u32], layout: WordLayout) {
    match layout {
        WordLayout::Whole => scan(changes, u32::wrapping_add),
        WordLayout::Halves => scan(changes, |word, change| add_parts(word, change, 0x8000_8000)),
        WordLayout::TwoBytes | WordLayout::Bytes => scan(changes, |word, change| add_parts(word, change, 0x8080_8080)),
    }
}

#[inline]
fn scan(changes: &mut [u32], add: impl Fn(u32, u32) -> u32) {
    let mut word = 0;
    for change in changes {
        word = add(word, *change);
        *change = word;
    }
}

/// Adds part by part: none carries over into the next. `tops` has the highest bit of each.
#[inline]
const fn add_parts(word: u32, change: u32, tops: u32) -> u32 {
    ((word & !tops) + (change & !tops)) ^ ((word ^ change) & tops)
}

#[inline]
fn whole_difference(word: u32, last: u32) -> u32 {
    let difference = word.wrapping_sub(last);
    (difference << 1) ^ ((difference as i32) >> 31) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Random;

    #[test]
    fn words_survive() {
        let mut random = Random::new(5);
        for count in [0, 1, 2, 7, 1000, BLOCK + 3] {
            for layout in [WordLayout::Whole, WordLayout::Halves, WordLayout::TwoBytes, WordLayout::Bytes] {
                let least_shift = if layout == WordLayout::TwoBytes { 16 } else { 0 };
                let mut word = || random.next_u32() >> (least_shift + random.below(32 - least_shift));
                let words: Vec<u32> = (0..count).map(|_| word()).collect();
                let mut bytes = Vec::new();
                pack_words(&words, layout, &mut bytes);
                assert!(bytes.len() <= max_words_bytes(words.len(), layout));
                assert_eq!(unpack_words(&mut &bytes[..], words.len(), layout), Ok(words));
            }
        }
    }
}
