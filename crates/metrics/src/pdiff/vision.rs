//! Published curves of human vision.

/// The number of levels of the pyramid, each about an octave smoother than the one before.
pub(super) const LEVELS: usize = 8;
/// The number of octaves of contrast: a band needs the two levels above it.
pub(super) const BANDS: usize = LEVELS - 2;
/// The frequency of peak contrast sensitivity at 100 cd/m², cycles a degree.
const PEAK_CYCLES_PER_DEGREE: f32 = 3.248;
/// Yee's bound on the fall of sensitivity.
const GREATEST_ELEVATION: f32 = 10.0;

/// The spatial frequencies of the pyramid's bands for one viewer.
pub(super) struct FrequencyBands {
    cycles_per_degree: [f32; BANDS],
    /// Peak sensitivity over that of the band, at 100 cd/m².
    inverse_relative_sensitivity: [f32; BANDS],
    /// The level whose smoothing stands for the degree around a pixel that the eye adapts to.
    pub(super) adaptation_level: usize,
}

impl FrequencyBands {
    pub(super) fn new(width_px: u32, field_of_view_deg: f32) -> Self {
        let image_deg = 2.0 * (field_of_view_deg.to_radians() / 2.0).tan().to_degrees();
        let pixels_per_degree = width_px as f32 / image_deg;
        let cycles_per_degree: [f32; BANDS] = std::array::from_fn(|band| 0.5 * pixels_per_degree / (1 << band) as f32);
        let peak = contrast_sensitivity(PEAK_CYCLES_PER_DEGREE, 100.0);
        Self {
            cycles_per_degree,
            inverse_relative_sensitivity: cycles_per_degree.map(|cycles| peak / contrast_sensitivity(cycles, 100.0)),
            adaptation_level: adaptation_level(image_deg),
        }
    }

    /// `F`: the rise of the threshold, 1 to 10.
    pub(super) fn threshold_elevation(&self, contrast: &[f32; BANDS], adaptation_cd_m2: f32) -> f32 {
        let weighted = contrast.iter().zip(self.cycles_per_degree).zip(self.inverse_relative_sensitivity);
        let elevations = weighted.map(|((&contrast, cycles), inverse_sensitivity)| {
            contrast * inverse_sensitivity * masking(contrast * contrast_sensitivity(cycles, adaptation_cd_m2))
        });
        let sum = contrast.iter().sum::<f32>().max(1e-5);
        (elevations.sum::<f32>() / sum).clamp(1.0, GREATEST_ELEVATION)
    }
}

/// The first level whose doubling support is wider than the image is in degrees.
fn adaptation_level(image_deg: f32) -> usize {
    (0..LEVELS - 1).find(|&level| (1_u32 << level) as f32 > image_deg).unwrap_or(LEVELS - 1)
}

/// Barten's contrast sensitivity.
fn contrast_sensitivity(cycles_per_degree: f32, luminance_cd_m2: f32) -> f32 {
    let a = 440.0 * (1.0 + 0.7 / luminance_cd_m2).powf(-0.2);
    let b = 0.3 * (1.0 + 100.0 / luminance_cd_m2).powf(0.15);
    // exp(-x) · sqrt(1 + 0.06 exp(x)), regrouped so that a large x underflows to 0 and not to 0 · ∞.
    let decay = (-b * cycles_per_degree).exp();
    a * cycles_per_degree * (decay * (decay + 0.06)).sqrt()
}

/// Daly's visual masking of a contrast in units of its own threshold.
fn masking(normalized_contrast: f32) -> f32 {
    let a = (392.498 * normalized_contrast).powf(0.7);
    let b = (0.0153 * a).powi(4);
    (1.0 + b).sqrt().sqrt()
}

/// Ward Larson's smallest visible difference in cd/m² at a luminance.
pub(super) fn threshold_vs_intensity(adaptation_cd_m2: f32) -> f32 {
    let log = adaptation_cd_m2.log10();
    let log_threshold = match log {
        _ if log < -3.94 => -2.86,
        _ if log < -1.44 => (0.405 * log + 1.6).powf(2.18) - 2.86,
        _ if log < -0.0184 => log - 0.395,
        _ if log < 1.9 => (0.249 * log + 0.65).powf(2.7) - 0.72,
        _ => log - 1.255,
    };
    10.0_f32.powf(log_threshold)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensitivity_peaks_where_it_should() {
        let peak = contrast_sensitivity(PEAK_CYCLES_PER_DEGREE, 100.0);
        for cycles in [0.5, 2.0, 5.0, 16.0] {
            assert!(contrast_sensitivity(cycles, 100.0) < peak, "{cycles}");
        }
        assert!(contrast_sensitivity(1e4, 1e-5).is_finite());
    }

    #[test]
    fn the_threshold_has_no_great_jump_where_its_pieces_meet() {
        for log in [-3.94_f32, -1.44, -0.0184, 1.9] {
            let below = threshold_vs_intensity(10_f32.powf(log - 1e-3));
            let above = threshold_vs_intensity(10_f32.powf(log + 1e-3));
            assert!((below / above - 1.0).abs() < 0.05, "{log}: {below} {above}");
        }
    }

    #[test]
    fn elevation_keeps_its_bounds() {
        let bands = FrequencyBands::new(4096, 45.0);
        for contrast in [[0.0; BANDS], [1e-6; BANDS], [1.0; BANDS], [1e5; BANDS]] {
            let elevation = bands.threshold_elevation(&contrast, 30.0);
            assert!((1.0..=10.0).contains(&elevation), "{contrast:?} {elevation}");
        }
    }
}
