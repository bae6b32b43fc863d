//! The range of vertex colours, which files of numbers do not state.

/// Above this no colour of the range 0…1 lies, even where its program rounds or overexposes.
const MAX_OF_UNIT_RANGE: f32 = 2.0;

/// The encoding of colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum ColorRange {
    #[default]
    None,
    /// Integers of 8 bits, or larger ones with the values of bytes.
    Bytes,
    /// Integers of 16 bits.
    Words,
    /// Numbers of 0…1, or 0…255, or 0…65535, of which the smallest range that holds all is taken.
    Floats,
}

/// Colours as the file has them. A channel that is not there is NaN.
#[derive(Default)]
pub(crate) struct Colors {
    pub range: ColorRange,
    pub values: Vec<[f32; 4]>,
}

impl Colors {
    /// A channel that is not there, or no number, is 255.
    pub(crate) fn srgba8(&self) -> Vec<[u8; 4]> {
        let scale = match self.range {
            ColorRange::Floats => self.scale_of_floats(),
            ColorRange::Words => 255.0 / 65_535.0,
            ColorRange::Bytes | ColorRange::None => 1.0,
        };
        let colors = self.values.iter();
        colors.map(|color| color.map(|c| if c.is_finite() { (c * scale + 0.5) as u8 } else { 255 })).collect()
    }

    fn scale_of_floats(&self) -> f32 {
        let most = self.values.iter().flatten().copied().filter(|c| c.is_finite()).fold(0.0, f32::max);
        if most <= MAX_OF_UNIT_RANGE {
            255.0
        } else if most <= 255.0 {
            1.0
        } else {
            255.0 / 65_535.0
        }
    }
}
