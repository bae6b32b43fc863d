//! Anti-aliasing: the positions within a pixel at which a view's colour is sampled.

use std::fmt;
use std::str::FromStr;

use glam::Vec2;

/// Samples a pixel, from 1 to 16 by powers of two. A view's colour is the mean of its samples in linear light; depth and
/// provenance are those of the pixel's centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Antialias(u32);

/// A number of samples a pixel that is not offered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("samples a pixel must be 1, 2, 4, 8 or 16")]
pub struct AntialiasError;

/// Positions in 1/32 of a pixel, from its upper left corner. Each two are symmetric about the centre, so that no picture
/// is shifted. All 16 are a (0,4,2)-net: every dyadic box of area 1/16 has one. The first 2, 4 and 8 lie in different
/// columns and rows of as many.
const POSITIONS: [[u8; 2]; 16] = [
    [9, 25],
    [23, 7],
    [25, 23],
    [7, 9],
    [3, 19],
    [29, 13],
    [19, 29],
    [13, 3],
    [27, 1],
    [5, 31],
    [21, 17],
    [11, 15],
    [17, 11],
    [15, 21],
    [1, 5],
    [31, 27],
];

impl Antialias {
    /// One sample, at the pixel's centre.
    pub const NONE: Self = Self(1);
    /// The most samples.
    pub const MOST: Self = Self(POSITIONS.len() as u32);

    /// `None` for a number that is not offered.
    #[must_use]
    pub fn of(samples: u32) -> Option<Self> {
        (samples.is_power_of_two() && samples <= Self::MOST.0).then_some(Self(samples))
    }

    /// Samples a pixel.
    #[must_use]
    pub fn samples(self) -> u32 {
        self.0
    }

    /// Where the samples are, in pixels from the centre.
    pub fn offsets_px(self) -> impl ExactSizeIterator<Item = Vec2> {
        POSITIONS.into_iter().take(self.0 as usize).map(move |[x, y]| match self {
            Self::NONE => Vec2::ZERO,
            _ => Vec2::new(f32::from(x), f32::from(y)) / 32.0 - 0.5,
        })
    }
}

impl Default for Antialias {
    fn default() -> Self {
        Self::NONE
    }
}

impl fmt::Display for Antialias {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

impl FromStr for Antialias {
    type Err = AntialiasError;

    fn from_str(text: &str) -> Result<Self, AntialiasError> {
        text.parse().ok().and_then(Self::of).ok_or(AntialiasError)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Boxes of `1 / columns` by `1 / rows` that have a position.
    fn boxes(samples: u32, columns: f32, rows: f32) -> usize {
        let of = |offset: Vec2| ((offset + 0.5) * Vec2::new(columns, rows)).floor().as_ivec2();
        Antialias::of(samples).unwrap().offsets_px().map(|offset| of(offset).to_array()).collect::<BTreeSet<_>>().len()
    }

    #[test]
    fn positions_are_even_and_do_not_shift_the_picture() {
        for samples in [1, 2, 4, 8, 16] {
            let offsets: Vec<Vec2> = Antialias::of(samples).unwrap().offsets_px().collect();
            assert_eq!(offsets.len(), samples as usize);
            assert_eq!(offsets.iter().sum::<Vec2>(), Vec2::ZERO, "{samples} samples");
            let count = samples as f32;
            assert_eq!([boxes(samples, count, 1.0), boxes(samples, 1.0, count)], [samples as usize; 2]);
        }
        for (columns, rows) in [(2.0, 8.0), (4.0, 4.0), (8.0, 2.0)] {
            assert_eq!(boxes(16, columns, rows), 16, "{columns} × {rows}");
        }
    }

    #[test]
    fn other_numbers_are_refused() {
        for text in ["1", "2", "4", "8", "16"] {
            assert_eq!(text.parse::<Antialias>().unwrap().to_string(), text);
        }
        for text in ["0", "3", "32", "-1", "4.0", "", "many"] {
            assert_eq!(text.parse::<Antialias>(), Err(AntialiasError), "{text}");
        }
    }
}
