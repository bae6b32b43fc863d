//! Exposure and tone curve: how a view's mean colour in linear light becomes one that a screen can show.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::ops::RangeInclusive;
use std::str::FromStr;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::srgb8_from_linear;

/// Exposures that are offered, in EV.
const EXPOSURES_EV: RangeInclusive<f32> = -16.0..=16.0;
/// The reflectance of a dielectric at normal incidence, which the curve takes off.
const DIELECTRIC: f32 = 0.04;
/// Peaks from here on are compressed.
const COMPRESSED_FROM: f32 = 0.8 - DIELECTRIC;
/// How fast compressed colours turn white.
const DESATURATION: f32 = 0.15;
/// Light beyond is shown as this: infinities are no colours. It is white on every curve.
const BRIGHTEST: f32 = 1e9;

/// An exposure in EV, a finite number from -16 to 16. One more doubles the light that a view shows.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "f32", into = "f32")]
pub struct ExposureEv(f32);

/// Why an exposure or a tone curve is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ToneError {
    /// Not a number, or beyond the limits.
    #[error("exposure must be from -16 to 16 EV")]
    Exposure,
    /// Text that is neither.
    #[error("exposure must be auto, or from -16 to 16 EV")]
    ExposureText,
    /// An unknown name.
    #[error("tone map must be none or khronos-neutral")]
    Curve,
}

/// An exposure as users choose it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Exposure {
    /// The plan's, which is measured once.
    Auto,
    /// This one.
    Ev(ExposureEv),
}

/// The curve from exposed light to shown light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ToneCurve {
    /// Light beyond white is cut off.
    #[default]
    None,
    /// Khronos PBR Neutral: base colours stay as they are, and highlights are compressed.
    KhronosNeutral,
}

/// How the mean colour of a pixel, in linear light, is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ToneMapping {
    /// Applied first.
    pub exposure: ExposureEv,
    /// Applied to the exposed light.
    pub curve: ToneCurve,
}

// Exposures are never NaN, and zero has one sign.
impl Eq for ExposureEv {}

impl Hash for ExposureEv {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.to_bits().hash(state);
    }
}

impl ExposureEv {
    /// Light as it is.
    pub const ZERO: Self = Self(0.0);

    /// # Errors
    /// For a number that is not finite, or beyond the limits.
    pub fn new(ev: f32) -> Result<Self, ToneError> {
        // Adding zero makes a negative zero positive.
        if EXPOSURES_EV.contains(&ev) { Ok(Self(ev + 0.0)) } else { Err(ToneError::Exposure) }
    }

    /// In EV.
    #[must_use]
    pub fn ev(self) -> f32 {
        self.0
    }

    /// The factor of light.
    #[must_use]
    pub fn factor(self) -> f32 {
        self.0.exp2()
    }
}

impl TryFrom<f32> for ExposureEv {
    type Error = ToneError;

    fn try_from(ev: f32) -> Result<Self, ToneError> {
        Self::new(ev)
    }
}

impl From<ExposureEv> for f32 {
    fn from(exposure: ExposureEv) -> Self {
        exposure.0
    }
}

impl fmt::Display for ExposureEv {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

impl fmt::Display for Exposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Ev(exposure) => exposure.fmt(f),
        }
    }
}

impl FromStr for Exposure {
    type Err = ToneError;

    fn from_str(text: &str) -> Result<Self, ToneError> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let ev: f32 = text.parse().map_err(|_| ToneError::ExposureText)?;
        ExposureEv::new(ev).map(Self::Ev).map_err(|_| ToneError::ExposureText)
    }
}

impl fmt::Display for ToneCurve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::KhronosNeutral => "khronos-neutral",
        })
    }
}

impl FromStr for ToneCurve {
    type Err = ToneError;

    fn from_str(text: &str) -> Result<Self, ToneError> {
        let curves = [Self::None, Self::KhronosNeutral];
        curves.into_iter().find(|curve| curve.to_string() == text).ok_or(ToneError::Curve)
    }
}

impl ToneMapping {
    /// Light as it is, cut off at white.
    pub const NONE: Self = Self { exposure: ExposureEv::ZERO, curve: ToneCurve::None };

    /// The light that a screen shows, for a pixel's mean colour.
    #[must_use]
    pub fn shown_linear(self, mean_linear: Vec3) -> Vec3 {
        let exposed_linear = mean_linear * self.exposure.factor();
        match self.curve {
            ToneCurve::None => exposed_linear,
            ToneCurve::KhronosNeutral => khronos_neutral(exposed_linear),
        }
    }

    /// The same as sRGB.
    #[must_use]
    pub fn srgb8(self, mean_linear: Vec3) -> [u8; 3] {
        self.shown_linear(mean_linear).to_array().map(srgb8_from_linear)
    }
}

/// The published function, with the twin in `tone.wgsl`.
fn khronos_neutral(exposed_linear: Vec3) -> Vec3 {
    let color = Vec3::from(exposed_linear.to_array().map(|v| if v > 0.0 { v.min(BRIGHTEST) } else { 0.0 }));
    let least = color.min_element();
    let offset = if least < 2.0 * DIELECTRIC { least - 0.25 / DIELECTRIC * least * least } else { DIELECTRIC };
    let based = color - offset;
    let peak = based.max_element();
    if peak < COMPRESSED_FROM {
        return based;
    }
    let room = 1.0 - COMPRESSED_FROM;
    let new_peak = 1.0 - room * room / (peak + room - COMPRESSED_FROM);
    let whiteness = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (based * (new_peak / peak)).lerp(Vec3::splat(new_peak), whiteness)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEUTRAL: ToneMapping = ToneMapping { exposure: ExposureEv::ZERO, curve: ToneCurve::KhronosNeutral };

    #[test]
    fn base_colors_of_dielectrics_stay_as_they_are() {
        for base in [Vec3::new(0.04, 0.3, 0.7), Vec3::splat(0.5), Vec3::new(0.75, 0.1, 0.05)] {
            let shown = NEUTRAL.shown_linear(base + DIELECTRIC);
            assert!((shown - base).abs().max_element() < 1e-6, "{base} is shown as {shown}");
        }
    }

    #[test]
    fn closed_forms_of_the_curve() {
        let grey = |v: f32| NEUTRAL.shown_linear(Vec3::splat(v)).x;
        assert!((grey(0.04) - 6.25 * 0.04 * 0.04).abs() < 1e-7, "the foot is a parabola");
        assert!((grey(0.8) - 0.76).abs() < 1e-6, "compression begins without a step");
        // 1 - 0.24² / (1 - 0.04 + 0.24 - 0.76)
        assert!((grey(1.0) - 0.869_090_9).abs() < 1e-6);
        let red = NEUTRAL.shown_linear(Vec3::new(4.0, 0.0, 0.0));
        let peak = 1.0 - 0.0576 / 3.48;
        let whiteness = 1.0 - 1.0 / (0.15 * (4.0 - peak) + 1.0);
        assert!((red - Vec3::new(peak, peak * whiteness, peak * whiteness)).abs().max_element() < 1e-6);
    }

    #[test]
    fn the_curve_rises_and_ends_at_white() {
        let mut last = -1.0;
        for step in 0..4000 {
            let shown = NEUTRAL.shown_linear(Vec3::splat((step as f32 * 0.01).exp2() * 1e-3)).x;
            assert!(shown >= last && shown <= 1.0, "step {step}: {last}, {shown}");
            last = shown;
        }
        assert!(last > 0.999);
    }

    #[test]
    fn every_input_gives_a_color() {
        let odd = [0.0, -1.0, 1e-30, 0.08, 1.0, 1e20, f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
        for (r, g) in odd.iter().flat_map(|&r| odd.map(|g| (r, g))) {
            for b in odd {
                let shown = NEUTRAL.shown_linear(Vec3::new(r, g, b));
                assert!(shown.is_finite() && shown.min_element() >= 0.0 && shown.max_element() <= 1.0, "{r} {g} {b}");
            }
        }
        assert_eq!(NEUTRAL.shown_linear(Vec3::ZERO), Vec3::ZERO);
    }

    #[test]
    fn no_mapping_changes_no_bit() {
        assert_eq!(ToneMapping::default(), ToneMapping::NONE);
        assert_eq!(ExposureEv::ZERO.factor().to_bits(), 1f32.to_bits());
        for v in [0.0, 1e-3, 0.3, 0.999, 1.0, 7.0] {
            let linear = Vec3::new(v, 0.5 * v, 0.1);
            assert_eq!(ToneMapping::NONE.shown_linear(linear), linear);
            assert_eq!(ToneMapping::NONE.srgb8(linear), linear.to_array().map(srgb8_from_linear));
        }
    }

    #[test]
    fn an_exposure_of_one_doubles_the_light() {
        let tone = ToneMapping { exposure: ExposureEv::new(1.0).unwrap(), curve: ToneCurve::None };
        assert_eq!(tone.shown_linear(Vec3::new(0.1, 0.2, 0.3)), Vec3::new(0.2, 0.4, 0.6));
        assert_eq!(ExposureEv::new(-0.0).unwrap().ev().to_bits(), 0, "equal exposures have equal bits");
    }

    #[test]
    fn other_texts_are_refused() {
        for text in ["auto", "0", "-2.5", "16"] {
            assert_eq!(text.parse::<Exposure>().unwrap().to_string(), text);
        }
        for text in ["nan", "inf", "99", "-16.5", "", "Auto", "1 EV"] {
            assert_eq!(text.parse::<Exposure>(), Err(ToneError::ExposureText), "{text}");
        }
        for text in ["none", "khronos-neutral"] {
            assert_eq!(text.parse::<ToneCurve>().unwrap().to_string(), text);
        }
        for text in ["foo", "", "None", "khronos"] {
            assert_eq!(text.parse::<ToneCurve>(), Err(ToneError::Curve), "{text}");
        }
    }
}
