//! Errors of a view in the terms of budgets.

use depth_image::{DepthImage, PinholeCamera, View};
use metrics::{MetricsError, Rgb8Image, flip_map, foreground, psnr_db, unheld_rate};
use planner::ViewErrors;

/// The errors of a view against the same view drawn from the scene, which has depth. The pixels that no sample camera sees
/// are those of a surface that no sample image holds.
///
/// # Errors
/// The views differ in size, or planes do not fit their cameras.
pub fn view_errors(
    camera: &PinholeCamera,
    truth: &View,
    view: &View,
    sample_images: &[DepthImage],
) -> Result<ViewErrors, MetricsError> {
    let (expected, actual) = (Rgb8Image::of_view(truth)?, Rgb8Image::of_view(view)?);
    let mask = foreground(truth, &actual)?;
    let flip = flip_map(&expected, &actual)?;
    let depth = truth.inverse_depth_per_m.as_deref().unwrap_or_default();
    let unheld = unheld_rate(camera, depth, sample_images)?.unwrap_or(0.0);
    let shown = mask.iter().filter(|&&shown| shown).count();
    let surfaces = depth.iter().filter(|&&inverse| inverse > 0.0).count();
    // An infinite ratio is an error of 0.
    let mean_square = psnr_db(&expected, &actual, Some(&mask))?.map_or(0.0, |db| 10_f64.powf(-db / 10.0));
    Ok(ViewErrors {
        foreground_ratio: shown as f64 / mask.len() as f64,
        flip: flip.mean(Some(&mask))?.unwrap_or(0.0),
        flip_whole: flip.mean(None)?.unwrap_or(0.0),
        mean_square,
        disoccluded_ratio: if shown == 0 { 0.0 } else { unheld * surfaces as f64 / shown as f64 },
    })
}
