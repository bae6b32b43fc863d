//! How far merged quads may be off what they replace.

use std::fmt;

/// The greatest error of merged quads, as seen from the side at the sample's distance: in hundredths of a sample pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ErrorBound(u16);

impl ErrorBound {
    const GREATEST: u16 = 10_000;

    /// From 0.01 to 100 pixels; `None` beyond, and for fractions of a hundredth.
    #[must_use]
    pub fn from_px(px: f64) -> Option<Self> {
        let hundredths = (px * 100.0).round();
        let fits = (1.0..=f64::from(Self::GREATEST)).contains(&hundredths) && (px * 100.0 - hundredths).abs() < 1e-6;
        fits.then_some(Self(hundredths as u16))
    }

    /// In pixels.
    #[must_use]
    pub fn px(self) -> f32 {
        f32::from(self.0) / 100.0
    }
}

impl fmt::Display for ErrorBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", f64::from(self.0) / 100.0)
    }
}
