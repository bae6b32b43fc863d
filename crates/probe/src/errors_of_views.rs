//! Errors of a view in the terms of budgets.

use depth_image::{PinholeCamera, View};
use metrics::{MetricsError, flip_map, foreground, psnr_db};
use planner::ViewErrors;

/// The errors of a view against the same view drawn from the scene, which has depth; with a mask, those of the pixels in it.
///
/// # Errors
/// The views or the mask differ in size, or planes do not fit their camera.
pub fn view_errors(
    camera: &PinholeCamera,
    truth: &View,
    view: &View,
    mask: Option<&[bool]>,
) -> Result<ViewErrors, MetricsError> {
    let whole = vec![true; camera.pixel_count()];
    let part = mask.unwrap_or(&whole);
    let shown = foreground(truth, view)?;
    let mask: Vec<bool> = shown.iter().zip(part).map(|(&shown, &own)| shown && own).collect();
    // An infinite ratio is an error of 0.
    let mean_square = psnr_db(truth, view, Some(&mask))?.map_or(0.0, |db| 10_f64.powf(-db / 10.0));
    Ok(ViewErrors {
        foreground_ratio: count(&mask) as f64 / count(part).max(1) as f64,
        flip: flip_map(truth, view)?.mean(Some(&mask))?.unwrap_or(0.0),
        mean_square,
    })
}

fn count(mask: &[bool]) -> usize {
    mask.iter().filter(|&&own| own).count()
}

#[cfg(test)]
mod tests {
    use glam::{UVec2, Vec3};

    use super::*;

    fn camera() -> PinholeCamera {
        PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(16))
    }

    /// Of a surface one metre away in the upper half, and nothing below.
    fn view(grey: u8, lower: u8) -> View {
        View {
            size_px: UVec2::splat(16),
            srgb8: (0..768).map(|byte| if byte < 384 { grey } else { lower }).collect(),
            inverse_depth_per_m: Some((0..256).map(|pixel| if pixel < 128 { 1.0 } else { 0.0 }).collect()),
            provenance: None,
        }
    }

    fn errors(test: &View) -> ViewErrors {
        view_errors(&camera(), &view(100, 0), test, None).unwrap()
    }

    #[test]
    fn a_step_of_grey_is_its_square_over_the_foreground_and_equal_views_have_no_error() {
        assert_eq!(errors(&view(100, 0)), ViewErrors { foreground_ratio: 0.5, ..ViewErrors::NONE });
        let step = errors(&view(151, 0));
        assert!((step.mean_square - 0.04).abs() < 1e-12 && step.flip > 0.0, "{step:?}");
    }

    #[test]
    fn errors_of_parts_add_up_to_those_of_the_view() {
        let whole = errors(&view(151, 9));
        assert_eq!(whole.foreground_ratio, 1.0, "the view shows something where its truth does not");
        let mut sum = 0.0;
        for first_row in [0, 4, 8, 12] {
            let part: Vec<bool> = (0..256).map(|pixel| (first_row..first_row + 4).contains(&(pixel / 16))).collect();
            let own = view_errors(&camera(), &view(100, 0), &view(151, 9), Some(&part)).unwrap();
            sum += own.foreground_ratio * own.flip / 4.0;
        }
        assert!((sum - whole.flip).abs() < 1e-6 && sum > 0.0, "{sum}: {whole:?}");
    }

    #[test]
    fn a_view_of_nothing_has_no_error_and_one_of_another_size_is_refused() {
        let empty = View { srgb8: vec![0; 768], inverse_depth_per_m: Some(vec![0.0; 256]), ..view(0, 0) };
        let nothing = view_errors(&camera(), &empty, &empty, None).unwrap();
        assert!(nothing.validate().is_ok() && nothing.foreground_ratio == 0.0 && nothing.flip == 0.0);
        let other = View { size_px: UVec2::splat(8), srgb8: vec![0; 192], ..empty.clone() };
        assert!(view_errors(&camera(), &empty, &other, None).is_err());
    }
}
