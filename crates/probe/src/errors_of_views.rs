//! Errors of a view in the terms of budgets.

use depth_image::{DepthImage, PinholeCamera, View};
use metrics::{MetricsError, flip_map, foreground, psnr_db, unheld_rate};
use planner::ViewErrors;

/// The errors of a view against the same view drawn from the scene, which has depth; with a mask, those of the pixels in it.
/// The pixels that no sample camera sees are those of a surface that no sample image holds.
///
/// # Errors
/// The views or the mask differ in size, or planes do not fit their cameras.
pub fn view_errors(
    camera: &PinholeCamera,
    truth: &View,
    view: &View,
    sample_images: &[DepthImage],
    mask: Option<&[bool]>,
) -> Result<ViewErrors, MetricsError> {
    let whole = vec![true; camera.pixel_count()];
    let part = mask.unwrap_or(&whole);
    let mask: Vec<bool> = foreground(truth, view)?.iter().zip(part).map(|(&shown, &own)| shown && own).collect();
    let flip = flip_map(truth, view)?;
    let depth = truth.inverse_depth_per_m.as_deref().unwrap_or_default();
    let depth: Vec<f32> = depth.iter().zip(part).map(|(&inverse, &own)| if own { inverse } else { 0.0 }).collect();
    let unheld = unheld_rate(camera, &depth, sample_images)?.unwrap_or(0.0);
    let shown = count(&mask);
    let surfaces = depth.iter().filter(|&&inverse| inverse > 0.0).count();
    // An infinite ratio is an error of 0.
    let mean_square = psnr_db(truth, view, Some(&mask))?.map_or(0.0, |db| 10_f64.powf(-db / 10.0));
    Ok(ViewErrors {
        foreground_ratio: shown as f64 / count(part).max(1) as f64,
        flip: flip.mean(Some(&mask))?.unwrap_or(0.0),
        flip_whole: flip.mean(Some(part))?.unwrap_or(0.0),
        mean_square,
        disoccluded_ratio: if shown == 0 { 0.0 } else { unheld * surfaces as f64 / shown as f64 },
    })
}

fn count(mask: &[bool]) -> usize {
    mask.iter().filter(|&&own| own).count()
}

#[cfg(test)]
mod tests {
    use depth_image::Camera;
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

    fn image(rows: usize) -> DepthImage {
        DepthImage {
            camera: Camera::Pinhole(camera()),
            inverse_depth_per_m: (0..256).map(|texel| if texel < 16 * rows { 1.0 } else { 0.0 }).collect(),
            color_rgb9e5: vec![0; 256],
            normal_oct16: None,
            surface_id: None,
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
            light: None,
        }
    }

    fn errors(test: &View, images: &[DepthImage]) -> ViewErrors {
        view_errors(&camera(), &view(100, 0), test, images, None).unwrap()
    }

    #[test]
    fn equal_views_have_no_error() {
        let errors = errors(&view(100, 0), &[image(8)]);
        let expected =
            ViewErrors { foreground_ratio: 0.5, flip: 0.0, flip_whole: 0.0, mean_square: 0.0, disoccluded_ratio: 0.0 };
        assert_eq!(errors, expected);
    }

    #[test]
    fn a_step_of_grey_is_its_square_over_the_foreground() {
        let errors = errors(&view(151, 0), &[image(8)]);
        assert!((errors.mean_square - 0.04).abs() < 1e-12, "{errors:?}");
        assert!(errors.flip > 1.5 * errors.flip_whole && errors.flip_whole > 0.0, "{errors:?}");
    }

    #[test]
    fn disocclusion_is_the_share_of_the_foreground_that_no_image_holds() {
        assert_eq!(errors(&view(100, 0), &[image(2)]).disoccluded_ratio, 0.75);
        assert_eq!(errors(&view(100, 0), &[]).disoccluded_ratio, 1.0);
        // A test that shows something everywhere has twice the foreground.
        let errors = errors(&view(100, 9), &[image(2)]);
        assert_eq!((errors.foreground_ratio, errors.disoccluded_ratio), (1.0, 0.375));
    }

    #[test]
    fn errors_of_parts_add_up_to_those_of_the_view() {
        let truth = view(100, 0);
        let test = view(151, 9);
        let images = [image(2)];
        let whole = view_errors(&camera(), &truth, &test, &images, None).unwrap();
        let mut sums = [0.0; 4];
        for first_row in [0, 4, 8, 12] {
            let part: Vec<bool> = (0..256).map(|pixel| (first_row..first_row + 4).contains(&(pixel / 16))).collect();
            let own = view_errors(&camera(), &truth, &test, &images, Some(&part)).unwrap();
            let of = own.foreground_ratio;
            let parts = [of, of * own.flip, own.flip_whole, of * own.disoccluded_ratio];
            sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part / 4.0);
        }
        let of = whole.foreground_ratio;
        let expected = [of, of * whole.flip, whole.flip_whole, of * whole.disoccluded_ratio];
        for (sum, expected) in sums.iter().zip(expected) {
            assert!((sum - expected).abs() < 1e-6 && expected > 0.0, "{sums:?}: {expected:?}");
        }
    }

    #[test]
    fn a_view_of_nothing_has_no_error_and_one_of_another_size_is_refused() {
        let empty = View { srgb8: vec![0; 768], inverse_depth_per_m: Some(vec![0.0; 256]), ..view(0, 0) };
        let errors = view_errors(&camera(), &empty, &empty, &[], None).unwrap();
        assert!(errors.validate().is_ok() && errors.foreground_ratio == 0.0 && errors.disoccluded_ratio == 0.0);
        let other = View { size_px: UVec2::splat(8), srgb8: vec![0; 192], ..empty.clone() };
        assert!(view_errors(&camera(), &empty, &other, &[], None).is_err());
        assert!(
            view_errors(&camera(), &View { inverse_depth_per_m: None, ..empty.clone() }, &empty, &[], None).is_err()
        );
    }
}
