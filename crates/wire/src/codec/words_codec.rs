//! Planes of 32-bit words, without loss: differences along the row, packed by class.
//!
//! LZ4 alone finds only what repeats to the bit. Differences of neighbours are small where a surface is
//! smooth and nothing where it is flat.

use super::{
    DecodeError,
    tagged::{BLOCK, Packer, max_packed_bytes, unpack, unzigzag, zigzag},
};

/// What a word is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WordLayout {
    /// One number of 32 bits.
    Whole,
    /// Two numbers of 16 bits, as in octahedral normals.
    Halves,
}

/// Most bytes that [`pack_words`] appends for `count` words.
pub(super) const fn max_words_bytes(count: usize) -> usize {
    2 * max_packed_bytes(count)
}

/// Appends `words` to `out`.
pub(super) fn pack_words(words: &[u32], layout: WordLayout, out: &mut Vec<u8>) {
    let mut packer = Packer::new(words.len());
    for block in words.chunks(BLOCK) {
        packer.pack(block.len(), out, |low| differences(block, layout, low, |(low, _)| low));
        packer.pack(block.len(), out, |high| differences(block, layout, high, |(_, high)| high));
    }
}

#[inline]
fn differences(words: &[u32], layout: WordLayout, out: &mut [u16], half: impl Fn((u16, u16)) -> u16) {
    match layout {
        WordLayout::Whole => for_neighbours(words, out, |word, last| half(whole_difference(word, last))),
        WordLayout::Halves => for_neighbours(words, out, |word, last| half(halves_difference(word, last))),
    }
}

/// What `number` makes of each word and the one before, 0 before the first.
#[inline]
pub(super) fn for_neighbours(words: &[u32], out: &mut [u16], number: impl Fn(u32, u32) -> u16) {
    let Some((first, others)) = out.split_first_mut() else {
        return;
    };
    *first = number(words[0], 0);
    for ((out, &last), &word) in others.iter_mut().zip(words).zip(&words[1..]) {
        *out = number(word, last);
    }
}

/// Reads `count` words from the front of `input`.
pub(super) fn unpack_words(input: &mut &[u8], count: usize, layout: WordLayout) -> Result<Vec<u32>, DecodeError> {
    let mut words = Vec::with_capacity(count);
    let mut halves = vec![0; 2 * count.min(BLOCK)];
    while words.len() < count {
        let block = (count - words.len()).min(BLOCK);
        let (low, high) = halves[..2 * block].split_at_mut(block);
        unpack(input, low)?;
        unpack(input, high)?;
        let mut word = 0;
        words.extend(low.iter().zip(high).map(|(&low, &mut high)| {
            word = apply(word, low, high, layout);
            word
        }));
    }
    Ok(words)
}

#[inline]
fn whole_difference(word: u32, last: u32) -> (u16, u16) {
    let difference = word.wrapping_sub(last);
    let number = (difference << 1) ^ ((difference as i32) >> 31) as u32;
    (number as u16, (number >> 16) as u16)
}

#[inline]
fn halves_difference(word: u32, last: u32) -> (u16, u16) {
    let low = (word as u16).wrapping_sub(last as u16);
    let high = ((word >> 16) as u16).wrapping_sub((last >> 16) as u16);
    (zigzag(low), zigzag(high))
}

#[inline]
fn apply(last: u32, low: u16, high: u16, layout: WordLayout) -> u32 {
    match layout {
        WordLayout::Whole => {
            let number = u32::from(low) | u32::from(high) << 16;
            last.wrapping_add((number >> 1) ^ (number & 1).wrapping_neg())
        }
        WordLayout::Halves => {
            let low = (last as u16).wrapping_add(unzigzag(low));
            let high = ((last >> 16) as u16).wrapping_add(unzigzag(high));
            u32::from(low) | u32::from(high) << 16
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::test_planes::Random;

    #[test]
    fn words_survive() {
        let mut random = Random::new(5);
        for count in [0, 1, 2, 7, 1000, BLOCK + 3] {
            for layout in [WordLayout::Whole, WordLayout::Halves] {
                let words: Vec<u32> = (0..count).map(|_| random.next_u32() >> random.below(32)).collect();
                let mut bytes = Vec::new();
                pack_words(&words, layout, &mut bytes);
                assert!(bytes.len() <= max_words_bytes(words.len()));
                assert_eq!(unpack_words(&mut &bytes[..], words.len(), layout), Ok(words));
            }
        }
    }
}
