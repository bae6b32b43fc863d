//! Planes beside a frame's colour, without loss: inverse depth and provenance.

use depth_image::HOLE_INVERSE_DEPTH;

use crate::{
    DecodeError,
    lz4::expand_lz4_up_to,
    words_codec::{WordLayout, max_words_bytes, pack_words, unpack_words},
};

/// Packs a plane of 32-bit words, such as the provenance of pixels.
#[must_use]
pub fn pack_u32_plane(words: &[u32]) -> Vec<u8> {
    let mut packed = Vec::with_capacity(2 * words.len());
    pack_words(words, WordLayout::Whole, &mut packed);
    lz4_flex::block::compress(&packed)
}

/// The inverse of [`pack_u32_plane`]. `texels` comes from a size that
/// [`DecodeLimits::texels`](crate::DecodeLimits::texels) has passed.
///
/// # Errors
/// Data that does not decode to exactly `texels`.
pub fn unpack_u32_plane(data: &[u8], texels: usize) -> Result<Vec<u32>, DecodeError> {
    let packed = expand_lz4_up_to(data, max_words_bytes(texels, WordLayout::Whole), "plane")?;
    let mut input = &packed[..];
    let words = unpack_words(&mut input, texels, WordLayout::Whole)?;
    if input.is_empty() { Ok(words) } else { Err(DecodeError::Corrupt { field: "plane", reason: "bytes left over" }) }
}

/// Packs a plane of inverse depths to the bit; numbers that are not finite become holes.
#[must_use]
pub fn pack_f32_plane(inverse_depth_per_m: &[f32]) -> Vec<u8> {
    let finite = |&value: &f32| {
        if value.is_finite() { value } else { HOLE_INVERSE_DEPTH }
    };
    let words: Vec<u32> = inverse_depth_per_m.iter().map(|value| finite(value).to_bits()).collect();
    pack_u32_plane(&words)
}

/// The inverse of [`pack_f32_plane`], with `texels` as in [`unpack_u32_plane`].
///
/// # Errors
/// Data that does not decode to exactly `texels`, all finite.
pub fn unpack_f32_plane(data: &[u8], texels: usize) -> Result<Vec<f32>, DecodeError> {
    let plane: Vec<f32> = unpack_u32_plane(data, texels)?.into_iter().map(f32::from_bits).collect();
    if plane.iter().all(|value| value.is_finite()) {
        return Ok(plane);
    }
    Err(DecodeError::Corrupt { field: "plane", reason: "not finite" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_planes::{Random, tree_over_terrain};

    #[test]
    fn planes_survive_to_the_bit() {
        let plane = tree_over_terrain(200, 150, 17);
        let packed = pack_f32_plane(&plane);
        let raw: Vec<u8> = plane.iter().flat_map(|value| value.to_le_bytes()).collect();
        assert!(packed.len() < lz4_flex::block::compress(&raw).len());
        assert_eq!(unpack_f32_plane(&packed, plane.len()), Ok(plane));
        let words: Vec<u32> = (0..30_000).map(|i| i / 700 * 0x0101).collect();
        assert_eq!(unpack_u32_plane(&pack_u32_plane(&words), words.len()), Ok(words));
    }

    #[test]
    fn numbers_that_are_not_finite_are_not_decoded() {
        let packed = pack_f32_plane(&[0.5, f32::NAN, f32::INFINITY, -0.0]);
        assert_eq!(unpack_f32_plane(&packed, 4), Ok(vec![0.5, HOLE_INVERSE_DEPTH, HOLE_INVERSE_DEPTH, 0.0]));
        assert!(unpack_f32_plane(&pack_u32_plane(&[f32::NAN.to_bits()]), 1).is_err());
    }

    #[test]
    fn damaged_planes_never_panic() {
        let good = pack_f32_plane(&tree_over_terrain(30, 20, 18));
        let mut random = Random::new(19);
        for _ in 0..4000 {
            let mut bad = good.clone();
            let at = random.below(bad.len());
            bad[at] ^= 1 << random.below(8);
            if let Ok(plane) = unpack_f32_plane(&bad, 600) {
                assert!(plane.len() == 600 && plane.iter().all(|value| value.is_finite()));
            }
            assert!(unpack_f32_plane(&good[..at], 600).is_err());
        }
    }
}
