//! Small numbers in few bits: a two-bit tag per number names one of four widths, the numbers follow
//! packed at those widths.
//!
//! The places of the numbers follow from the tags alone, so that neither side waits for one number before it finds the
//! next. The widths are chosen for each stream from a histogram of bit lengths. The tags
//! are left for LZ4 to shorten: where an image is smooth they are all alike.
//!
//! Layout of a block: three width bytes (the fourth width is 16), one byte for every four tags, then the
//! fields, least significant bits first. The count is not stored: the reader knows it. Streams are cut
//! in blocks of [`BLOCK`], small enough that all passes over one stay in the cache.

use crate::DecodeError;

/// Numbers of a block; only the last of a stream has fewer.
pub(crate) const BLOCK: usize = 1 << 14;

const WIDEST_BITS: u8 = 16;
const WIDTHS_BYTES: usize = 3;
/// Bits that eight bytes hold besides those of an unfinished byte, with one to spare: a shift by all 64 is not defined.
const ROOM_BITS: u8 = 56;
/// Bytes that one store may write beyond the fields.
const SLACK_BYTES: usize = 8;

/// Most bytes of `count` numbers in blocks.
pub(crate) const fn max_packed_bytes(count: usize) -> usize {
    count.div_ceil(BLOCK) * WIDTHS_BYTES + count.div_ceil(4) * 9
}

/// Maps small differences of either sign to small numbers.
#[inline]
pub(crate) const fn zigzag(difference: u16) -> u16 {
    (difference << 1) ^ ((difference as i16) >> 15) as u16
}

/// The inverse of [`zigzag`].
#[inline]
pub(crate) const fn unzigzag(number: u16) -> u16 {
    (number >> 1) ^ (number & 1).wrapping_neg()
}

/// Packs blocks; keeps its buffers from one to the next.
pub(crate) struct Packer {
    numbers: Vec<u16>,
    tags: Vec<u16>,
    fields: Vec<u8>,
}

impl Packer {
    pub(crate) fn new(count: usize) -> Self {
        let numbers = count.min(BLOCK).next_multiple_of(4);
        Self { numbers: vec![0; numbers], tags: vec![0; numbers], fields: vec![0; numbers * 2 + SLACK_BYTES] }
    }

    /// Appends one block to `out`: `count` numbers that `fill` writes, at most [`BLOCK`] and the count of [`Packer::new`].
    pub(crate) fn pack(&mut self, count: usize, out: &mut Vec<u8>, fill: impl FnOnce(&mut [u16])) {
        fill(&mut self.numbers[..count]);
        let padded = count.next_multiple_of(4);
        self.numbers[count..padded].fill(0);
        self.pack_filled(padded, out);
    }

    fn pack_filled(&mut self, padded: usize, out: &mut Vec<u8>) {
        let numbers = &self.numbers[..padded];
        let widths = choose_widths(numbers);
        let limits = [widths[0], widths[1], widths[2]].map(|width| 1u16 << width);
        for (tag, &number) in self.tags.iter_mut().zip(numbers) {
            *tag = u16::from(number >= limits[0]) + u16::from(number >= limits[1]) + u16::from(number >= limits[2]);
        }
        out.extend_from_slice(&widths[..WIDTHS_BYTES]);
        let tags_start = out.len();
        out.resize(tags_start + padded / 4, 0);
        let tag_bytes = &mut out[tags_start..];
        tag_bytes.iter_mut().zip(self.tags.as_chunks::<4>().0).for_each(|(byte, tags)| *byte = tag_byte(tags));
        let fields_bytes = pack_fields(numbers, tag_bytes, &quad_table(widths), &mut self.fields);
        out.extend_from_slice(&self.fields[..fields_bytes]);
    }
}

#[inline]
fn tag_byte(tags: &[u16; 4]) -> u8 {
    let [a, b, c, d] = tags.map(u64::from);
    let together = a | b << 16 | c << 32 | d << 48;
    (together | together >> 14 | together >> 28 | together >> 42) as u8
}

fn pack_fields(numbers: &[u16], tags: &[u8], quads: &[Quad; 256], fields: &mut [u8]) -> usize {
    let mut writer = BitWriter { fields, next_byte: 0, pending: 0, pending_bits: 0 };
    for (numbers, &tag) in numbers.as_chunks::<4>().0.iter().zip(tags) {
        let quad = &quads[usize::from(tag)];
        let [a, b, c, d] = numbers.map(u64::from);
        let first = a | b << quad.first_bits;
        let second = c | d << quad.third_bits;
        if quad.bits <= ROOM_BITS {
            writer.push(first | second << quad.pair_bits, quad.bits);
        } else {
            writer.push(first, quad.pair_bits);
            writer.push(second, quad.bits - quad.pair_bits);
        }
    }
    writer.next_byte + usize::from(writer.pending_bits > 0)
}

struct BitWriter<'a> {
    fields: &'a mut [u8],
    next_byte: usize,
    pending: u64,
    pending_bits: u32,
}

impl BitWriter<'_> {
    /// Stores eight bytes and keeps those that are full.
    #[inline]
    fn push(&mut self, word: u64, bits: u8) {
        self.pending |= word << self.pending_bits;
        self.pending_bits += u32::from(bits);
        self.fields[self.next_byte..self.next_byte + SLACK_BYTES].copy_from_slice(&self.pending.to_le_bytes());
        self.next_byte += (self.pending_bits / 8) as usize;
        self.pending >>= self.pending_bits & !7;
        self.pending_bits &= 7;
    }
}

/// The three widths below 16 that make the fields shortest, judged by a thousand numbers.
fn choose_widths(numbers: &[u16]) -> [u8; 4] {
    let mut of_length = [0u32; 17];
    for &number in numbers.iter().step_by(1 + numbers.len() / 1024) {
        of_length[(16 - number.leading_zeros()) as usize] += 1;
    }
    let mut up_to = of_length;
    for length in 1..up_to.len() {
        up_to[length] += up_to[length - 1];
    }
    let pairs = (0..14).flat_map(|a| (a + 1..15).map(move |b| (a, b)));
    let candidates = pairs.flat_map(|(a, b)| (b + 1..16).map(move |c| [a, b, c, WIDEST_BITS]));
    // Against 16 bits for all, each width saves its distance to the next for every number that fits it.
    let chosen = candidates.max_by_key(|widths| {
        let saved = widths.windows(2).map(|pair| up_to[usize::from(pair[0])] * u32::from(pair[1] - pair[0]));
        saved.sum::<u32>()
    });
    chosen.unwrap_or([0, 5, 10, WIDEST_BITS])
}

/// The meaning of a byte of four tags.
#[derive(Clone, Copy)]
struct Quad {
    masks: [u16; 4],
    first_bits: u8,
    pair_bits: u8,
    third_bits: u8,
    bits: u8,
}

fn quad_table(widths: [u8; 4]) -> [Quad; 256] {
    std::array::from_fn(|tags| {
        let [a, b, c, d] = [0, 2, 4, 6].map(|shift| widths[tags >> shift & 3]);
        let masks = [a, b, c, d].map(|width| ((1u32 << width) - 1) as u16);
        Quad { masks, first_bits: a, pair_bits: a + b, third_bits: c, bits: a + b + c + d }
    })
}

/// Reads one block of `numbers.len()` numbers from the front of `input` and moves it past them.
pub(crate) fn unpack(input: &mut &[u8], numbers: &mut [u16]) -> Result<(), DecodeError> {
    let widths = take(input, WIDTHS_BYTES)?;
    let widths = [widths[0], widths[1], widths[2], WIDEST_BITS];
    if !widths.is_sorted() {
        return Err(DecodeError::Corrupt { field: "tagged.widths", reason: "not ascending up to 16" });
    }
    let quads = quad_table(widths);
    let tags = take(input, numbers.len().div_ceil(4))?;
    let bits: usize = tags.iter().map(|&tag| usize::from(quads[usize::from(tag)].bits)).sum();
    let fields = take(input, bits.div_ceil(8))?;
    let mut bit = 0;
    let mut unpacked = tags.iter().map(|&tag| {
        let quad = &quads[usize::from(tag)];
        let at = bit;
        bit += usize::from(quad.bits);
        unpack_quad(fields, at, quad)
    });
    let (whole, rest) = numbers.as_chunks_mut::<4>();
    whole.iter_mut().zip(&mut unpacked).for_each(|(out, quad)| *out = quad);
    if let Some(last) = unpacked.next() {
        rest.copy_from_slice(&last[..rest.len()]);
    }
    Ok(())
}

#[inline]
fn unpack_quad(fields: &[u8], bit: usize, quad: &Quad) -> [u16; 4] {
    let first = load_u64(fields, bit);
    let second = load_u64(fields, bit + usize::from(quad.pair_bits));
    let numbers = [first, first >> quad.first_bits, second, second >> quad.third_bits];
    std::array::from_fn(|i| numbers[i] as u16 & quad.masks[i])
}

/// At least 57 bits from a bit position; zeros beyond the end.
#[inline]
fn load_u64(fields: &[u8], bit: usize) -> u64 {
    let from = fields.get(bit / 8..).unwrap_or_default();
    let bytes = from.first_chunk::<8>().copied().unwrap_or_else(|| last_bytes(from));
    u64::from_le_bytes(bytes) >> (bit % 8)
}

#[cold]
fn last_bytes(from: &[u8]) -> [u8; 8] {
    let mut padded = [0; 8];
    padded[..from.len()].copy_from_slice(from);
    padded
}

/// Splits `count` bytes off the front.
pub(crate) fn take<'a>(input: &mut &'a [u8], count: usize) -> Result<&'a [u8], DecodeError> {
    input.split_off(..count).ok_or(DecodeError::Corrupt { field: "payload", reason: "ends too early" })
}

/// Splits an array off the front.
pub(crate) fn take_array<const N: usize>(input: &mut &[u8]) -> Result<[u8; N], DecodeError> {
    let array = take(input, N)?.first_chunk();
    array.copied().ok_or(DecodeError::Corrupt { field: "payload", reason: "ends too early" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Random;

    fn round_trip(numbers: &[u16]) -> usize {
        let mut packed = vec![7];
        Packer::new(numbers.len()).pack(numbers.len(), &mut packed, |out| out.copy_from_slice(numbers));
        assert!(packed.len() - 1 <= max_packed_bytes(numbers.len()));
        packed.push(9);
        let mut input = &packed[1..];
        let mut back = vec![0; numbers.len()];
        unpack(&mut input, &mut back).expect("own stream");
        assert_eq!(input, [9]);
        assert_eq!(back, numbers);
        packed.len() - 2
    }

    #[test]
    fn every_length_and_width_survives() {
        let mut random = Random::new(1);
        for length in 1..70 {
            for width in 0..=16 {
                let numbers: Vec<_> = (0..length).map(|_| (random.next_u32() & ((1 << width) - 1)) as u16).collect();
                round_trip(&numbers);
            }
        }
    }

    #[test]
    fn zeros_cost_two_bits_each() {
        assert_eq!(round_trip(&[0; 1000]), WIDTHS_BYTES + 250);
    }

    #[test]
    fn unzigzag_inverts_zigzag() {
        assert!((0..=u16::MAX).all(|difference| unzigzag(zigzag(difference)) == difference));
        assert_eq!([0, 1, u16::MAX, 2].map(zigzag), [0, 2, 1, 4]);
    }

    #[test]
    fn cut_streams_are_refused() {
        let mut packed = Vec::new();
        Packer::new(5).pack(5, &mut packed, |out| out.copy_from_slice(&[1, 2, 60_000, 4, 5]));
        for length in 0..packed.len() {
            assert!(unpack(&mut &packed[..length], &mut [0; 5]).is_err());
        }
    }
}
