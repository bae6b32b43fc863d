//! Frames for thin clients: 8-bit sRGB, with loss or without.

use std::{fmt, str::FromStr};

use bytes::Bytes;

use crate::{
    DecodeError, DecodeLimits, FrameError,
    error::check_limit,
    jpeg,
    lz4::expand_lz4,
    rgb_filter::{filter, unfilter},
};

/// The packing of frames: `lz4`, `jpeg` or `jpeg:QUALITY` in settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum FrameCodec {
    /// Without loss: differences along the row, LZ4.
    #[default]
    Lz4,
    /// Baseline JPEG.
    Jpeg {
        /// 1 to 100.
        quality: u8,
    },
}

const DEFAULT_JPEG_QUALITY: u8 = 90;

/// An encoded frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EncodedFrame {
    /// How the data is packed.
    pub codec: FrameCodec,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// CRC-32 of the data.
    pub crc32: u32,
    /// The packed pixels.
    pub data: Bytes,
}

/// Why a text names no codec.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("frame codec {0:?}, must be lz4, jpeg or jpeg:QUALITY with a quality of 1 to 100")]
pub struct ParseFrameCodecError(String);

impl FromStr for FrameCodec {
    type Err = ParseFrameCodecError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let quality = match text.split_once(':') {
            None if text == "lz4" => return Ok(Self::Lz4),
            None if text == "jpeg" => Some(DEFAULT_JPEG_QUALITY),
            Some(("jpeg", quality)) => quality.parse().ok().filter(|quality| (1..=100).contains(quality)),
            _ => None,
        };
        quality.map(|quality| Self::Jpeg { quality }).ok_or_else(|| ParseFrameCodecError(text.to_owned()))
    }
}

impl fmt::Display for FrameCodec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lz4 => f.write_str("lz4"),
            Self::Jpeg { quality } => write!(f, "jpeg:{quality}"),
        }
    }
}

/// Packs a frame of three bytes a pixel, rows top-down.
///
/// # Errors
/// A slice that is not of the frame's size; a size or quality that JPEG cannot have.
pub fn encode_frame(codec: FrameCodec, width: u32, height: u32, rgb: &[u8]) -> Result<EncodedFrame, FrameError> {
    let (pixels, rest) = rgb.as_chunks::<3>();
    if !rest.is_empty() || width == 0 || pixels.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(FrameError::Size { width, height, rgb_bytes: rgb.len() });
    }
    let data: Bytes = match codec {
        FrameCodec::Lz4 => lz4_flex::block::compress(&filter(pixels)).into(),
        FrameCodec::Jpeg { quality } => jpeg::encode(width, height, rgb, quality)?.into(),
    };
    Ok(EncodedFrame { codec, width, height, crc32: crc32fast::hash(&data), data })
}

/// Unpacks a frame to three bytes a pixel.
///
/// # Errors
/// A size or data over the limits; a wrong checksum; data that does not decode to that size.
pub fn decode_frame(frame: &EncodedFrame, limits: &DecodeLimits) -> Result<Vec<u8>, FrameError> {
    let pixels = limits.texels(frame.width, frame.height)?;
    check_limit("frame data", frame.data.len() as u64, limits.max_payload_bytes as u64)?;
    if crc32fast::hash(&frame.data) != frame.crc32 {
        return Err(FrameError::Checksum);
    }
    match frame.codec {
        FrameCodec::Lz4 => Ok(decode_lossless(&frame.data, pixels)?),
        FrameCodec::Jpeg { .. } => jpeg::decode(frame.width, frame.height, &frame.data),
    }
}

fn decode_lossless(data: &[u8], pixels: usize) -> Result<Vec<u8>, DecodeError> {
    let mut rgb = expand_lz4(data, pixels * 3, "frame")?;
    unfilter(&mut rgb);
    Ok(rgb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_planes::{Random, tree_over_terrain};

    fn picture(width: usize, height: usize) -> Vec<u8> {
        let plane = tree_over_terrain(width, height, 15);
        let shade = |inverse: f32| [150.0, 700.0, 600.0].map(|gain| (inverse * gain) as u8);
        plane.iter().flat_map(|&inverse| shade(inverse)).collect()
    }

    fn limits() -> DecodeLimits {
        DecodeLimits { max_texels: 1 << 16, ..DecodeLimits::default() }
    }

    #[test]
    fn lz4_frames_survive_to_the_bit() {
        for (width, height) in [(1, 1), (3, 2), (200, 150)] {
            let rgb = picture(width, height);
            let frame = encode_frame(FrameCodec::Lz4, width as u32, height as u32, &rgb).expect("right size");
            assert_eq!(decode_frame(&frame, &limits()).as_ref(), Ok(&rgb));
        }
    }

    #[test]
    fn gradients_pack_better_than_by_lz4_alone() {
        let rgb: Vec<u8> =
            (0..200 * 150).flat_map(|i| [i % 200, i / 200, i % 200 / 2 + i / 400].map(|c| c as u8)).collect();
        let frame = encode_frame(FrameCodec::Lz4, 200, 150, &rgb).expect("right size");
        assert!(frame.data.len() < lz4_flex::block::compress(&rgb).len());
    }

    #[test]
    fn jpeg_frames_are_close() {
        let rgb: Vec<u8> = (0..64 * 48).flat_map(|i| [(i % 64) as u8 * 2, (i / 64) as u8 * 3, 90]).collect();
        let frame = encode_frame(FrameCodec::Jpeg { quality: 95 }, 64, 48, &rgb).expect("right size");
        let back = decode_frame(&frame, &limits()).expect("own encoding");
        assert_eq!(back.len(), rgb.len());
        assert!(rgb.iter().zip(&back).all(|(a, b)| a.abs_diff(*b) <= 12));
        let wrong = EncodedFrame { width: 48, height: 64, ..frame };
        assert!(matches!(decode_frame(&wrong, &limits()), Err(FrameError::Jpeg(_))));
    }

    #[test]
    fn damaged_frames_never_panic() {
        let rgb = picture(40, 30);
        let mut random = Random::new(16);
        for codec in [FrameCodec::Lz4, FrameCodec::Jpeg { quality: 80 }] {
            let good = encode_frame(codec, 40, 30, &rgb).expect("right size");
            for case in 0..4000 {
                let mut data = good.data.to_vec();
                let at = random.below(data.len());
                data[at] ^= 1 << random.below(8);
                data.truncate(if case % 3 == 0 { at } else { data.len() });
                let bad = EncodedFrame { data: data.into(), ..good.clone() };
                assert_eq!(decode_frame(&bad, &limits()), Err(FrameError::Checksum));
                let sealed = EncodedFrame { crc32: crc32fast::hash(&bad.data), ..bad };
                if let Ok(rgb) = decode_frame(&sealed, &limits()) {
                    assert_eq!(rgb.len(), 40 * 30 * 3);
                }
            }
        }
    }

    #[test]
    fn sizes_are_checked_first() {
        assert!(matches!(encode_frame(FrameCodec::Lz4, 2, 2, &[0; 11]), Err(FrameError::Size { .. })));
        assert!(encode_frame(FrameCodec::Jpeg { quality: 0 }, 1, 1, &[0; 3]).is_err());
        let frame = encode_frame(FrameCodec::Lz4, 1, 1, &[1, 2, 3]).expect("right size");
        for (width, height) in [(0, 1), (65_535, 65_535), (16_384, 16_384), (300, 300), (9, 9)] {
            assert!(decode_frame(&EncodedFrame { width, height, ..frame.clone() }, &limits()).is_err());
        }
    }

    #[test]
    fn names_of_codecs_survive() {
        for name in ["lz4", "jpeg:1", "jpeg:90", "jpeg:100"] {
            assert_eq!(name.parse::<FrameCodec>().expect(name).to_string(), name);
        }
        assert_eq!("jpeg".parse(), Ok(FrameCodec::Jpeg { quality: 90 }));
        for name in ["", "png", "lz4:3", "jpeg:0", "jpeg:101", "jpeg:", "JPEG"] {
            assert!(name.parse::<FrameCodec>().is_err(), "{name}");
        }
    }
}
