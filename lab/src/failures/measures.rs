//! Figures of views beside the truth. A view with a depth that is no number has no figure: it is NaN, which no shape has.

use anyhow::Context as _;
use depth_image::{DepthImage, ProvenanceKind, View};
use metrics::PictureErrors;

use crate::evaluation::mean_errors;

/// The greatest relative error of depth that counts for one pixel: a wrong surface may be arbitrarily far away.
const MOST_DEPTH_ERROR: f64 = 0.1;

const NO_FIGURE: PictureErrors = PictureErrors { psnr_db: f64::NAN, ssim: f64::NAN, flip: f64::NAN };

/// The mean errors over the foreground.
///
/// # Errors
/// Views differ in size, or a truth has no depth.
pub fn foreground(truths: &[View], views: &[View]) -> anyhow::Result<PictureErrors> {
    let [foreground, _] = mean_errors(truths, views)?;
    let is_sane = views.iter().all(|view| depths(view).iter().all(|depth| depth.is_finite() && *depth >= 0.0));
    Ok(if is_sane { foreground } else { NO_FIGURE })
}

pub fn depths(view: &View) -> &[f32] {
    view.inverse_depth_per_m.as_deref().unwrap_or_default()
}

/// A view's pixels are of this kind.
pub fn is_kind(view: &View, kind: ProvenanceKind) -> impl Iterator<Item = bool> + '_ {
    view.provenance.iter().flatten().map(move |provenance| provenance.kind() == kind)
}

/// The share of pixels that are of a kind.
pub fn share_of_kind(views: &[View], kind: ProvenanceKind) -> f64 {
    share(views.iter().flat_map(|view| is_kind(view, kind)))
}

/// The share of the truth's surfaces that views show as a hit.
pub fn found(truths: &[View], views: &[View]) -> f64 {
    let pairs = truths.iter().zip(views);
    share(pairs.flat_map(|(truth, view)| {
        let surfaces = depths(truth).iter().zip(is_kind(view, ProvenanceKind::Hit));
        surfaces.filter(|(depth, _)| **depth > 0.0).map(|(_, hit)| hit)
    }))
}

/// The share of the truth's surfaces that views do not hold: they show nothing there, or something more than `behind_m` farther away.
pub fn not_held(truths: &[View], views: &[View], behind_m: f32) -> f64 {
    let pairs = truths.iter().zip(views).flat_map(|(truth, view)| depths(truth).iter().zip(depths(view)));
    let surfaces = pairs.filter(|(truth, _)| **truth > 0.0);
    // No surface is as far away as it can be: its inverse depth is 0.
    share(surfaces.map(|(truth, view)| 1.0 / view.max(0.0) > 1.0 / truth + behind_m))
}

/// The mean relative error of depth, where the truth and the view have a surface.
///
/// # Errors
/// There is no such pixel.
pub fn depth_error(truths: &[View], views: &[View]) -> anyhow::Result<f64> {
    let pairs = truths.iter().zip(views).flat_map(|(truth, view)| {
        let hits = is_kind(view, ProvenanceKind::Hit);
        depths(truth).iter().zip(depths(view)).zip(hits).filter(|((truth, _), hit)| *hit && **truth > 0.0)
    });
    let errors: Vec<f64> = pairs.map(|((truth, depth), _)| f64::from((depth / truth - 1.0).abs())).collect();
    mean(errors.into_iter().map(|error| if error > MOST_DEPTH_ERROR { MOST_DEPTH_ERROR } else { error }))
        .context("no pixel shows a surface in both views")
}

/// The share that is true; NaN of nothing.
pub fn share(of: impl IntoIterator<Item = bool>) -> f64 {
    mean(of.into_iter().map(|is| f64::from(u8::from(is)))).unwrap_or(f64::NAN)
}

/// `None` of nothing.
pub fn mean(of: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = of.into_iter().fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// The number of samples of an image.
pub fn samples(image: &DepthImage) -> usize {
    image.inverse_depth_per_m.iter().filter(|&&depth| depth > 0.0).count()
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    /// Each depth is that of two rows.
    fn view(depths: [f32; 4]) -> View {
        let inverse_depth_per_m = depths.map(|depth| [depth; 16]).concat();
        let kind = |depth: &f32| if *depth > 0.0 { ProvenanceKind::Hit } else { ProvenanceKind::Empty };
        View {
            size_px: UVec2::splat(8),
            srgb8: vec![100; 192],
            provenance: Some(inverse_depth_per_m.iter().map(|d| depth_image::Provenance::new(kind(d), 1)).collect()),
            inverse_depth_per_m: Some(inverse_depth_per_m),
        }
    }

    #[test]
    fn a_depth_that_is_no_number_leaves_no_figure() {
        let truth = [view([1.0; 4])];
        assert_eq!(foreground(&truth, &[view([1.0; 4])]).unwrap().flip, 0.0);
        assert!(foreground(&truth, &[view([1.0, 1.0, f32::NAN, 1.0])]).unwrap().flip.is_nan());
        assert!(depth_error(&truth, &[view([1.0, 1.0, f32::INFINITY, 1.0])]).unwrap() >= 0.025);
    }

    #[test]
    fn shares_and_errors_are_those_of_surfaces() {
        let truth = [view([1.0, 1.0, 1.0, 0.0])];
        let test = [view([1.01, 1.0, 0.0, 0.0])];
        assert!((found(&truth, &test) - 2.0 / 3.0).abs() < 1e-9);
        assert!((depth_error(&truth, &test).unwrap() - 0.005).abs() < 1e-6);
        assert!((not_held(&truth, &test, 0.1) - 1.0 / 3.0).abs() < 1e-9);
        assert_eq!(not_held(&test, &truth, 0.005), 0.5);
        assert_eq!(share_of_kind(&test, ProvenanceKind::Hit), 0.5);
        assert!(share([]).is_nan() && mean([]).is_none());
        assert!(depth_error(&truth, &[view([0.0; 4])]).is_err());
    }
}
