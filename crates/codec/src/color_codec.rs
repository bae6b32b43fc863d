//! RGB9E5 colours, without loss: a bit for each that differs from the sample before, and the differences.
//!
//! One bit a sample marks a change of colour: unlit surfaces seldom change, and LZ4 shortens bits that are all alike. The
//! mantissas and the exponent of colours that change follow as differences. Green comes first; red and blue are stored as
//! how much more they change, since hues vary less than brightness. The differences are of mantissas as they stand: they
//! jump where the exponent changes, which is rare.
//!
//! `docs/methods/depth_codec.md` shows how much the bits save.

use crate::DecodeError;
use crate::tagged::{BLOCK, Packer, max_packed_bytes, take, unpack, unzigzag, zigzag};
use crate::words_codec::for_neighbours;

const MANTISSA: u32 = 511;
const EXPONENT: u32 = 31;

/// Most bytes that [`pack_colors`] appends for `count` colours.
pub(crate) const fn max_colors_bytes(count: usize) -> usize {
    count.div_ceil(8) + 4 * max_packed_bytes(count)
}

/// Appends `colors_rgb9e5` to `out`.
pub(crate) fn pack_colors(colors_rgb9e5: &[u32], out: &mut Vec<u8>) {
    let mut packer = Packer::new(colors_rgb9e5.len());
    let mut changed = vec![0; colors_rgb9e5.len().min(BLOCK)];
    for block in colors_rgb9e5.chunks(BLOCK) {
        let count = pack_changes(block, &mut changed, out);
        pack_differences(&changed[..count], &mut packer, out);
    }
}

/// Appends a bit for each colour, the first in the lowest: whether it differs from the one before, 0 before the first.
/// Puts the colours that differ first in `changed` and gives their count; each of these differs from the one before, too.
fn pack_changes(colors_rgb9e5: &[u32], changed: &mut [u32], out: &mut Vec<u8>) -> usize {
    let mut count = 0;
    let mut last = 0;
    out.extend(colors_rgb9e5.chunks(8).map(|eight| {
        (0..).zip(eight).fold(0, |bits, (place, &color)| {
            let is_change = color != last;
            // Overwritten unless it counts: no branch depends on the colour.
            changed[count] = color;
            count += usize::from(is_change);
            last = color;
            bits | u8::from(is_change) << place
        })
    }));
    count
}

fn pack_differences(colors_rgb9e5: &[u32], packer: &mut Packer, out: &mut Vec<u8>) {
    pack_channel(colors_rgb9e5, packer, out, |color, last| fold(green(color, last), MANTISSA));
    pack_channel(colors_rgb9e5, packer, out, |color, last| fold(beside_green(color, last, 0), MANTISSA));
    pack_channel(colors_rgb9e5, packer, out, |color, last| fold(beside_green(color, last, 18), MANTISSA));
    pack_channel(colors_rgb9e5, packer, out, |color, last| fold(change(color, last, 27, EXPONENT), EXPONENT));
}

fn pack_channel(colors: &[u32], packer: &mut Packer, out: &mut Vec<u8>, number: impl Fn(u32, u32) -> u16) {
    packer.pack(colors.len(), out, |out| for_neighbours(colors, out, number));
}

/// Reads `count` colours from the front of `input`.
pub(crate) fn unpack_colors(input: &mut &[u8], count: usize) -> Result<Vec<u32>, DecodeError> {
    let mut colors = Vec::with_capacity(count);
    let mut channels = [(); 4].map(|()| vec![0; count.min(BLOCK)]);
    // The first entry is the 0 before the first colour.
    let mut changed = vec![0; count.min(BLOCK) + 1];
    while colors.len() < count {
        let block = (count - colors.len()).min(BLOCK);
        let (changes, change_count) = take_changes(input, block)?;
        unpack_differences(input, &mut channels, &mut changed[1..=change_count])?;
        extend_by_repeats(&mut colors, &changed[..=change_count], changes, block);
    }
    Ok(colors)
}

/// A bit for each of `count` colours, and how many change.
fn take_changes<'a>(input: &mut &'a [u8], count: usize) -> Result<(&'a [u8], usize), DecodeError> {
    let changes = take(input, count.div_ceil(8))?;
    let spare_bits = 8 * changes.len() - count;
    if changes.last().is_some_and(|last| (last.leading_zeros() as usize) < spare_bits) {
        return Err(DecodeError::Corrupt { field: "color_rgb9e5", reason: "changes beyond the last sample" });
    }
    Ok((changes, changes.iter().map(|bits| bits.count_ones() as usize).sum()))
}

fn unpack_differences(
    input: &mut &[u8],
    channels: &mut [Vec<u16>; 4],
    colors_rgb9e5: &mut [u32],
) -> Result<(), DecodeError> {
    for channel in &mut *channels {
        unpack(input, &mut channel[..colors_rgb9e5.len()])?;
    }
    let [green, red, blue, exponent] = channels.each_ref();
    let mut color = [0u32; 4];
    let numbers = green.iter().zip(red).zip(blue).zip(exponent);
    for (out, (((&green, &red), &blue), &exponent)) in colors_rgb9e5.iter_mut().zip(numbers) {
        color = apply(color, [green, red, blue, exponent]);
        let [r, g, b, e] = color;
        *out = (r & MANTISSA) | (g & MANTISSA) << 9 | (b & MANTISSA) << 18 | e << 27;
    }
    Ok(())
}

/// Appends `count` colours; `changed` has the colour before the first, then one for each bit in `changes`.
fn extend_by_repeats(colors_rgb9e5: &mut Vec<u32>, changed: &[u32], changes: &[u8], count: usize) {
    let start = colors_rgb9e5.len();
    colors_rgb9e5.resize(start + count, 0);
    let mut place = 0;
    for (eight, &bits) in colors_rgb9e5[start..].chunks_mut(8).zip(changes) {
        for (shift, color) in eight.iter_mut().enumerate() {
            place += usize::from(bits >> shift & 1);
            *color = changed[place];
        }
    }
}

/// Red, green, blue and exponent, in bits beyond their fields too, where they do not matter.
#[inline]
fn apply([r, g, b, e]: [u32; 4], numbers: [u16; 4]) -> [u32; 4] {
    let [green, red, blue, exponent] = numbers.map(|number| u32::from(unzigzag(number)));
    [
        r.wrapping_add(green).wrapping_add(red),
        g.wrapping_add(green),
        b.wrapping_add(green).wrapping_add(blue),
        e.wrapping_add(exponent),
    ]
}

#[inline]
fn change(color: u32, last: u32, shift: u32, mask: u32) -> u32 {
    (color >> shift & mask).wrapping_sub(last >> shift & mask)
}

#[inline]
fn green(color: u32, last: u32) -> u32 {
    change(color, last, 9, MANTISSA)
}

/// How much more the mantissa at a bit changes than green.
#[inline]
fn beside_green(color: u32, last: u32, shift: u32) -> u32 {
    change(color, last, shift, MANTISSA).wrapping_sub(green(color, last))
}

/// A change modulo a field's size, as a small number: the shorter way round.
#[inline]
fn fold(change: u32, mask: u32) -> u16 {
    let half = mask.div_ceil(2);
    let shortest = (change.wrapping_add(half) & mask).wrapping_sub(half);
    zigzag(shortest as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Random;

    #[test]
    fn colors_survive() {
        let mut random = Random::new(6);
        for count in [0, 1, 5, 3000, BLOCK + 1] {
            for repeats in 1..=3 {
                let mut last = 0;
                let mut color = || {
                    last = if random.below(repeats) == 0 { random.next_u32() } else { last };
                    last
                };
                let colors: Vec<u32> = (0..count).map(|_| color()).collect();
                let mut bytes = Vec::new();
                pack_colors(&colors, &mut bytes);
                assert!(bytes.len() <= max_colors_bytes(colors.len()));
                assert_eq!(unpack_colors(&mut &bytes[..], colors.len()), Ok(colors));
            }
        }
    }

    #[test]
    fn constant_colors_take_a_bit_each() {
        let mut bytes = Vec::new();
        pack_colors(&[0; 1001], &mut bytes);
        assert_eq!(bytes[..126], [0; 126]);
        assert_eq!(bytes.len(), 126 + 4 * 3);
    }

    #[test]
    fn changes_beyond_the_last_sample_are_refused() {
        let beyond = Err(DecodeError::Corrupt { field: "color_rgb9e5", reason: "changes beyond the last sample" });
        assert_eq!(unpack_colors(&mut &[0b0010_0000][..], 5), beyond);
        assert_eq!(unpack_colors(&mut &[0, 0b1000_0000][..], 15), beyond);
    }

    #[test]
    fn changes_that_are_missing_or_have_no_differences_are_refused() {
        let early = Err(DecodeError::Corrupt { field: "payload", reason: "ends too early" });
        assert_eq!(unpack_colors(&mut &[0][..], 9), early);
        assert_eq!(unpack_colors(&mut &[0b0001_0000][..], 5), early);
    }

    #[test]
    fn damaged_colors_never_panic() {
        let mut random = Random::new(15);
        let colors: Vec<u32> = (0..501).map(|at| if at % 5 < 3 { 7 } else { random.next_u32() }).collect();
        let mut good = Vec::new();
        pack_colors(&colors, &mut good);
        for _ in 0..4000 {
            let mut bytes = good.clone();
            // Bits of changes as often as all else.
            let among = if random.below(2) == 0 { bytes.len() } else { 63 };
            let at = random.below(among);
            bytes[at] = random.next_u32() as u8;
            bytes.truncate(if random.below(4) == 0 { random.below(bytes.len()) } else { bytes.len() });
            let back = unpack_colors(&mut &bytes[..], colors.len());
            assert!(back.is_err() || back.is_ok_and(|back| back.len() == colors.len()));
        }
    }

    #[test]
    fn noisy_colors_beat_plain_lz4() {
        let mut random = Random::new(7);
        let color =
            |x: u32, noise: u32| (200 + x / 16 + noise) | (180 + x / 20 + noise) << 9 | (90 + noise) << 18 | 15 << 27;
        let colors: Vec<u32> = (0..4000).map(|x| color(x % 400, random.next_u32() & 7)).collect();
        let raw: Vec<u8> = colors.iter().flat_map(|color| color.to_le_bytes()).collect();
        let mut bytes = Vec::new();
        pack_colors(&colors, &mut bytes);
        assert!(lz4_flex::block::compress(&bytes).len() < lz4_flex::block::compress(&raw).len());
    }
}
