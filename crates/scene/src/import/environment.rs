//! Environment maps from Radiance files (`.hdr`), within limits that are checked before a texel is decoded.

use std::borrow::Cow;
use std::path::Path;

use depth_image::{EnvironmentMap, MAX_ENVIRONMENT_SIZE_PX};
use glam::{UVec2, Vec3};
use image::ImageDecoder as _;
use image::codecs::hdr::HdrDecoder;

use super::folder::Folder;
use crate::{Fault, Limits, SceneError};

/// Larger files are refused; those above [`MAX_ENVIRONMENT_SIZE_PX`] are reduced.
const MAX_FILE_SIZE_PX: UVec2 = UVec2::new(8192, 4096);
/// A file of the largest size without compression, and a header.
const MAX_FILE_BYTES: u64 = 4 * 8192 * 4096 + (1 << 20);
/// The greatest channel of RGB9E5.
const MAX_RADIANCE: f32 = 65_408.0;

/// Reads an equirectangular `.hdr` file. Its pixels are divided by the exposure and the colour correction that its header
/// names. A map of more than 4096×2048 texels is reduced, and radiances above 65,408 are clamped, each with a warning.
///
/// # Errors
/// The file, the element at fault, and the reason.
pub fn load_environment(path: &Path) -> Result<EnvironmentMap, SceneError> {
    read(path).map_err(|fault| fault.in_file(path.display().to_string()))
}

fn read(path: &Path) -> Result<EnvironmentMap, Fault> {
    let limits = Limits { file_bytes: MAX_FILE_BYTES, ..Limits::default() };
    let (_, bytes) = Folder::open(path, &limits)?;
    let (size_px, radiance_linear) = decoded(&with_plain_line_ends(&bytes))?;
    let clamped = radiance_linear.iter().filter(|radiance| radiance.max_element() > MAX_RADIANCE).count();
    let (reduced_px, radiance_linear) = reduced(size_px, radiance_linear);
    let map = EnvironmentMap::new(reduced_px, &radiance_linear).map_err(|e| malformed(&e.to_string()))?;
    let file = path.display();
    if reduced_px != size_px {
        tracing::warn!("{file}: {size_px} texels are reduced to {reduced_px}");
    }
    if clamped > 0 {
        tracing::warn!("{file}: the radiance of {clamped} texels is clamped to {MAX_RADIANCE}");
    }
    Ok(map)
}

fn malformed(reason: &str) -> Fault {
    Fault::malformed("environment map", reason)
}

/// The file with line feeds alone in its header, which ends with the line after the first empty one. Programs on Windows
/// write carriage returns as well.
fn with_plain_line_ends(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut header = Vec::new();
    let mut is_last = false;
    for line in bytes.split_inclusive(|&byte| byte == b'\n') {
        let Some(text) = line.strip_suffix(b"\r\n") else {
            // Texels, or a header that has plain line ends.
            return bytes.into();
        };
        header.extend_from_slice(text);
        header.push(b'\n');
        if is_last {
            let header_bytes = header.len() + header.iter().filter(|&&byte| byte == b'\n').count();
            return [&header, &bytes[header_bytes..]].concat().into();
        }
        is_last = text.is_empty();
    }
    bytes.into()
}

/// Size and radiances, row by row.
fn decoded(bytes: &[u8]) -> Result<(UVec2, Vec<Vec3>), Fault> {
    // Some programs write another name into the first line; all else is equal.
    let is_named_otherwise = bytes.starts_with(b"#?RGBE");
    let open = if is_named_otherwise { HdrDecoder::new_nonstrict } else { HdrDecoder::new };
    let decoder = open(bytes).map_err(|e| malformed(&format!("header: {e}")))?;
    let size_px = UVec2::from(decoder.dimensions());
    if size_px.min_element() == 0 || size_px.cmpgt(MAX_FILE_SIZE_PX).any() {
        let UVec2 { x, y } = size_px;
        return Err(malformed(&format!("size: {x}×{y} texels, expected 1×1 to 8192×4096")));
    }
    let scale = scale_of(&decoder)?;
    let mut texels = vec![Vec3::ZERO; size_px.element_product() as usize];
    let read = decoder.read_image(bytemuck::cast_slice_mut(&mut texels));
    read.map_err(|e| malformed(&format!("texels: {e}")))?;
    texels.iter_mut().for_each(|texel| *texel *= scale);
    Ok((size_px, texels))
}

/// The factor from pixels to radiance.
fn scale_of(decoder: &HdrDecoder<&[u8]>) -> Result<Vec3, Fault> {
    let header = decoder.metadata();
    let (r, g, b) = header.color_correction.unwrap_or((1.0, 1.0, 1.0));
    let divisor = Vec3::new(r, g, b) * header.exposure.unwrap_or(1.0);
    let is_usable = divisor.is_finite() && divisor.min_element() > 0.0 && divisor.recip().is_finite();
    if !is_usable {
        return Err(malformed(&format!("EXPOSURE and COLORCORR: {divisor} is not positive and finite")));
    }
    Ok(divisor.recip())
}

/// Means of squares of texels, where there are too many.
fn reduced(size_px: UVec2, texels: Vec<Vec3>) -> (UVec2, Vec<Vec3>) {
    let side = ((size_px + MAX_ENVIRONMENT_SIZE_PX - 1) / MAX_ENVIRONMENT_SIZE_PX).max_element();
    if side == 1 {
        return (size_px, texels);
    }
    let reduced_px = (size_px + side - 1) / side;
    let places = (0..reduced_px.y).flat_map(|y| (0..reduced_px.x).map(move |x| UVec2::new(x, y)));
    let means = places.map(|place| {
        let first = place * side;
        let end = ((place + 1) * side).min(size_px);
        let rows = (first.y..end.y).map(|y| (y * size_px.x) as usize);
        let sum: Vec3 = rows.flat_map(|row| &texels[row + first.x as usize..row + end.x as usize]).sum();
        sum / (end - first).element_product() as f32
    });
    (reduced_px, means.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_beyond_the_limit_is_reduced_to_its_means() {
        let size_px = UVec2::new(5000, 3);
        let texels = (0..15_000).map(|i| Vec3::splat((i % 5000) as f32)).collect();
        let (reduced_px, means) = reduced(size_px, texels);
        assert_eq!(reduced_px, UVec2::new(2500, 2));
        assert_eq!((means[0].x, means[2499].x, means[2500].x), (0.5, 4998.5, 0.5));
    }
}
