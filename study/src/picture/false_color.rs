//! Colours that stand for numbers.

use image::{Rgb, RgbImage};
use metrics::ScoreMap;

use crate::ReportError;

const BACKGROUND: [u8; 3] = [40, 44, 52];
const UNKNOWN: [u8; 3] = [255, 0, 200];

/// One colour a sample camera; more cameras begin again.
const CAMERAS: [[u8; 3]; 8] = [
    [86, 180, 233],
    [230, 159, 0],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
    [153, 213, 148],
];

/// A map of 0…1 in magma: black is no error, pale yellow the greatest.
#[must_use]
pub fn error_map(map: &ScoreMap) -> RgbImage {
    let (width_px, height_px) = map.size_px();
    let color = |value: f32| gradient(colorous::MAGMA, value);
    RgbImage::from_fn(width_px, height_px, |x, y| color(map.values()[(y * width_px + x) as usize]))
}

/// Inverse depth in viridis, nearest yellow, farthest violet, over the range found. Background is dark grey,
/// a texel without a sample magenta.
///
/// # Errors
/// Rows that are not whole.
pub fn depth_false_color(inverse_depth_per_m: &[f32], width_px: u32) -> Result<RgbImage, ReportError> {
    let surfaces = || inverse_depth_per_m.iter().copied().filter(|&depth| depth > 0.0 && depth.is_finite());
    let (least, greatest) = (surfaces().fold(f32::MAX, f32::min), surfaces().fold(0.0, f32::max));
    let span = (greatest - least).max(f32::MIN_POSITIVE);
    let color = |depth: &f32| match *depth {
        depth if depth > 0.0 => gradient(colorous::VIRIDIS, (depth - least) / span),
        0.0 => Rgb(BACKGROUND),
        _ => Rgb(UNKNOWN),
    };
    picture("depth", inverse_depth_per_m.iter().map(color), width_px)
}

/// Where a pixel's colour comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Provenance {
    /// One sample camera, by number.
    Sample(u8),
    /// Several sample cameras.
    Blend,
    /// Drawn directly.
    Direct,
    /// Filled in from around a hole.
    Fill,
    /// Nothing is there.
    Background,
    /// No answer, and not filled.
    Unknown,
}

impl Provenance {
    /// In pictures and legends.
    #[must_use]
    pub fn color(self) -> [u8; 3] {
        match self {
            Self::Sample(camera) => CAMERAS[usize::from(camera) % CAMERAS.len()],
            Self::Blend => [255, 255, 255],
            Self::Direct => [150, 150, 160],
            Self::Fill => [255, 60, 60],
            Self::Background => BACKGROUND,
            Self::Unknown => UNKNOWN,
        }
    }

    /// In legends.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Sample(camera) => format!("sample {camera}"),
            Self::Blend => "blend".into(),
            Self::Direct => "direct".into(),
            Self::Fill => "fill".into(),
            Self::Background => "background".into(),
            Self::Unknown => "unknown".into(),
        }
    }

    /// Names and colours of those that occur.
    #[must_use]
    pub fn legend(pixels: &[Self]) -> Vec<(String, [u8; 3])> {
        let found: std::collections::BTreeSet<Self> = pixels.iter().copied().collect();
        found.into_iter().map(|one| (one.name(), one.color())).collect()
    }
}

/// A colour a provenance; [`Provenance::legend`] names them.
///
/// # Errors
/// Rows that are not whole.
pub fn provenance_false_color(provenance: &[Provenance], width_px: u32) -> Result<RgbImage, ReportError> {
    picture("provenance", provenance.iter().map(|one| Rgb(one.color())), width_px)
}

fn gradient(gradient: colorous::Gradient, value: f32) -> Rgb<u8> {
    let share = if value.is_nan() { 0.0 } else { f64::from(value.clamp(0.0, 1.0)) };
    Rgb(gradient.eval_continuous(share).as_array())
}

fn picture(
    what: &'static str,
    pixels: impl ExactSizeIterator<Item = Rgb<u8>>,
    width_px: u32,
) -> Result<RgbImage, ReportError> {
    let len = pixels.len();
    let wrong = || ReportError::PictureSize { what, len, width_px };
    let height_px = (len as u32).checked_div(width_px).ok_or_else(wrong)?;
    if (width_px as usize) * (height_px as usize) != len {
        return Err(wrong());
    }
    let bytes: Vec<u8> = pixels.flat_map(|pixel| pixel.0).collect();
    RgbImage::from_raw(width_px, height_px, bytes).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;
    use metrics::{Rgb8Image, flip_map};

    #[test]
    fn no_error_is_black_and_the_greatest_is_pale() {
        let flat = |rgb: [u8; 3]| Rgb8Image::new(2, 2, rgb.repeat(4)).unwrap();
        let none = error_map(&flip_map(&flat([9; 3]), &flat([9; 3])).unwrap());
        assert_eq!(none[(0, 0)].0, [0, 0, 4]);
        let all = error_map(&flip_map(&flat([0, 255, 0]), &flat([0, 0, 255])).unwrap());
        assert!(all[(1, 1)].0.iter().all(|&channel| channel > 180), "{:?}", all[(1, 1)]);
    }

    #[test]
    fn depth_says_near_far_none_and_hole_apart() {
        let image = depth_false_color(&[1.0, 0.1, 0.0, -1.0], 2).unwrap();
        assert_eq!(image[(0, 0)].0, [253, 231, 37]);
        assert_eq!(image[(1, 0)].0, [68, 1, 84]);
        assert_eq!((image[(0, 1)].0, image[(1, 1)].0), (BACKGROUND, UNKNOWN));
        assert!(depth_false_color(&[1.0; 4], 2).is_ok());
    }

    #[test]
    fn ragged_rows_are_refused() {
        assert!(provenance_false_color(&[Provenance::Fill; 5], 2).is_err());
        assert!(provenance_false_color(&[Provenance::Fill; 5], 0).is_err());
    }

    #[test]
    fn the_legend_names_what_occurs_once() {
        let legend = Provenance::legend(&[Provenance::Fill, Provenance::Sample(1), Provenance::Fill]);
        let names: Vec<&str> = legend.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["sample 1", "fill"]);
    }
}
