//! `WxH`, and numbers within limits, on the command line.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use depth_image::MAX_IMAGE_SIDE_PX;
use glam::UVec2;

/// Columns and rows of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SizePx(pub UVec2);

/// The most columns or rows of a grid.
const MAX_GRID_SIDE: u32 = 1000;

/// A text that is no pair of numbers, or has too large ones.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is no size: expected two whole numbers from 1 to {most} with an x between, as in 400x300")]
pub struct SizeError {
    text: String,
    most: u32,
}

fn pair(text: &str, most: u32) -> Result<[u32; 2], SizeError> {
    let sides = text.split_once(['x', 'X', '×']).and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
    sides
        .filter(|sides| sides.iter().all(|side| (1..=most).contains(side)))
        .ok_or_else(|| SizeError { text: text.to_owned(), most })
}

/// Columns and rows of the blocks of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockGrid(pub UVec2);

/// The most columns or rows of blocks.
const MAX_BLOCK_GRID_SIDE: u32 = 8;

impl fmt::Display for BlockGrid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.0.x, self.0.y)
    }
}

impl FromStr for BlockGrid {
    type Err = SizeError;
    fn from_str(text: &str) -> Result<Self, SizeError> {
        pair(text, MAX_BLOCK_GRID_SIDE).map(|sides| Self(sides.into()))
    }
}

/// The size of sample images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SampleSize {
    /// As the views of a session need it.
    #[default]
    Auto,
    /// Columns and rows.
    Fixed(UVec2),
}

impl SampleSize {
    /// Columns and rows; `None` where they follow the views.
    #[must_use]
    pub fn fixed_px(self) -> Option<UVec2> {
        match self {
            Self::Auto => None,
            Self::Fixed(size_px) => Some(size_px),
        }
    }
}

impl FromStr for SampleSize {
    type Err = SizeError;
    fn from_str(text: &str) -> Result<Self, SizeError> {
        if text == "auto" { Ok(Self::Auto) } else { text.parse().map(|size: SizePx| Self::Fixed(size.0)) }
    }
}

impl fmt::Display for SampleSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Fixed(size_px) => write!(f, "{}x{}", size_px.x, size_px.y),
        }
    }
}

impl FromStr for SizePx {
    type Err = SizeError;
    fn from_str(text: &str) -> Result<Self, SizeError> {
        pair(text, MAX_IMAGE_SIDE_PX).map(|sides| Self(sides.into()))
    }
}

/// A parser of numbers within a range.
pub fn within(range: RangeInclusive<f64>) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text: &str| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("expected {} to {}", range.start(), range.end()))
    }
}

/// Columns and rows of a grid of views.
///
/// # Errors
/// For anything else than two whole numbers from 1 to 1000.
pub fn grid(text: &str) -> Result<[u32; 2], SizeError> {
    pair(text, MAX_GRID_SIDE)
}

impl fmt::Display for SizePx {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.0.x, self.0.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_numbers_in_range() {
        assert_eq!("400x300".parse(), Ok(SizePx(UVec2::new(400, 300))));
        assert_eq!(grid("5x2"), Ok([5, 2]));
        for bad in ["", "400", "0x3", "3x0", "65535x65535", "-1x4", "axb", "4x4x4"] {
            assert!(bad.parse::<SizePx>().is_err(), "{bad}");
        }
        assert!(grid("1001x1").is_err());
    }

    #[test]
    fn numbers_outside_of_a_range_are_refused() {
        for text in ["0", "-1", "NaN", "inf", "a day", ""] {
            assert!(within(0.01..=1.0)(text).is_err() && within(0.001..=86_400.0)(text).is_err(), "{text}");
        }
        assert_eq!((within(0.01..=1.0)("0.5"), within(0.001..=86_400.0)("600")), (Ok(0.5), Ok(600.0)));
        assert_eq!(within(0.01..=1000.0)("0"), Err("expected 0.01 to 1000".to_owned()));
    }
}
