//! KTX2 pictures of Basis Universal, which `basisu` decodes. Their header is checked here, before memory is allocated.

use basisu::{DecodeFlags, TargetFormat, Transcoder};

const MAGIC: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";
/// Bytes of the header, and of the first level in the index after it.
const HEADER_BYTES: usize = 104;
/// Both codecs store blocks of 4×4 texels.
const BLOCK_SIDE_PX: u64 = 4;
const UASTC_BLOCK_BYTES: u64 = 16;
/// Supercompression schemes.
const PLAIN: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTANDARD: u32 = 2;

/// Returns whether a file says that it is KTX2.
pub(crate) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Columns and rows. The error is the reason for which the picture is not read.
pub(crate) fn size_px(bytes: &[u8]) -> Result<(u32, u32), String> {
    let header = bytes.get(..HEADER_BYTES).ok_or("its KTX2 header is cut off")?;
    let word = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    let [vulkan_format, width_px, height_px, depth_px] = [word(12), word(20), word(24), word(28)];
    let [layers, faces, scheme] = [word(32), word(36), word(44)];
    if vulkan_format != 0 {
        return Err(format!("its KTX2 holds Vulkan's format {vulkan_format}; only Basis Universal is read"));
    }
    if width_px == 0 || height_px == 0 || depth_px > 0 || layers > 1 || faces != 1 {
        return Err("its KTX2 holds something other than one flat picture".into());
    }
    let blocks = u64::from(width_px).div_ceil(BLOCK_SIDE_PX) * u64::from(height_px).div_ceil(BLOCK_SIDE_PX);
    let decoded_bytes = u64::from(word(96)) | u64::from(word(100)) << 32;
    match scheme {
        PLAIN | BASIS_LZ => {}
        ZSTANDARD if decoded_bytes == blocks * UASTC_BLOCK_BYTES => {}
        ZSTANDARD => return Err(format!("its KTX2 claims {decoded_bytes} bytes for {blocks} blocks")),
        other => return Err(format!("its KTX2 has supercompression {other}; only BasisLZ and Zstandard are read")),
    }
    Ok((width_px, height_px))
}

/// The texels of the largest level, RGBA, row by row. The caller has checked [`size_px`] against its limits.
pub(crate) fn rgba8(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let (width_px, height_px) = size_px(bytes)?;
    let transcoder = Transcoder::new(bytes).map_err(damaged)?;
    if transcoder.is_video() || !transcoder.supports(TargetFormat::Rgba32) {
        return Err("its KTX2 holds a video, or high dynamic range".into());
    }
    let texels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(damaged)?;
    let expected = u64::from(width_px) * u64::from(height_px) * 4;
    if texels.len() as u64 == expected { Ok(texels) } else { Err("its KTX2 decodes to another size".into()) }
}

fn damaged(error: basisu::Error) -> String {
    format!("its KTX2 is cut off, damaged, or not Basis Universal: {error:?}")
}
