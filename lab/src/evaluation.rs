//! Reconstructed views against reference views, pixel by pixel.

use anyhow::Context as _;
use depth_image::{Provenance, ProvenanceKind, View, ViewPlanes};
use metrics::{DepthErrors, PictureErrors, PixelClass, depth_errors};
use rayon::prelude::*;
use reconstruction::ReconstructionMethod;

use crate::reference_views::ReferenceViews;
use crate::statistics::{mean_of, sum_of};

/// A channel off by more than this, out of 255, is a wrong colour.
const WRONG_COLOR: u8 = 16;
/// Views that a method is timed on.
const TIMED_VIEWS: usize = 64;

/// Accuracy and speed of a method. Shares are of 1, over all views together.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// The method.
    pub method: ReconstructionMethod,
    /// One view in a batch, to host pixels.
    pub ms_a_view: f64,
    /// Over the pixels that show a surface; means over views.
    pub foreground: PictureErrors,
    /// The foreground's PSNR of the worst view.
    pub foreground_psnr_min_db: f64,
    /// Over whole pictures; means over views.
    pub whole: PictureErrors,
    /// PSNR of the worst view.
    pub psnr_min_db: f64,
    /// Hits off by more than 1 % in depth, of all hits.
    pub wrong_hits: f64,
    /// Pixels that no sample camera knows, of all.
    pub unknown: f64,
    /// Disoccluded pixels with a wrong colour, of the disoccluded; NaN where there are none.
    pub disoccluded_wrong: f64,
    /// Disoccluded pixels with a wrong colour that are not marked as filled, of the disoccluded.
    pub disoccluded_unmarked: f64,
    /// Disoccluded pixels, of all.
    pub disoccluded: f64,
}

impl ReferenceViews {
    /// Evaluates a method, timed on a batch of views.
    pub fn evaluate(&self, method: ReconstructionMethod, runs: usize) -> anyhow::Result<Evaluation> {
        let ms_a_view = self.ms_a_view(method, TIMED_VIEWS, runs)?;
        let views = self.reconstruct(method, ViewPlanes::ALL)?;
        let pairs: Vec<_> = self.views.iter().zip(&views).zip(self.classes()).collect();
        let errors = pairs
            .into_par_iter()
            .map(|((reference, view), classes)| Errors::of(reference, view, classes))
            .collect::<anyhow::Result<Vec<_>>>()?;
        Ok(evaluation(method, ms_a_view, &errors))
    }
}

/// Errors of one view.
struct Errors {
    /// Over the foreground, then over the whole picture.
    pictures: [PictureErrors; 2],
    depth: DepthErrors,
    disoccluded: usize,
    /// Disoccluded pixels of a wrong colour.
    disoccluded_wrong: usize,
    /// Those of a wrong colour that are not marked as filled.
    disoccluded_unmarked: usize,
}

impl Errors {
    fn of(reference: &View, view: &View, classes: &[PixelClass]) -> anyhow::Result<Self> {
        let pictures = PictureErrors::of(reference, view)?;
        let depth = depth_errors(&known_depth(reference)?, &known_depth(view)?)?;
        let mut errors = Self { pictures, depth, disoccluded: 0, disoccluded_wrong: 0, disoccluded_unmarked: 0 };
        let provenance = view.provenance.as_ref().context("a view without provenance")?;
        let colors = reference.srgb8.as_chunks::<3>().0.iter().zip(view.srgb8.as_chunks::<3>().0);
        let wrong = colors.map(|(a, b)| (0..3).any(|i| a[i].abs_diff(b[i]) > WRONG_COLOR));
        for ((class, wrong), provenance) in classes.iter().zip(wrong).zip(provenance) {
            if *class == PixelClass::Disoccluded {
                errors.disoccluded += 1;
                errors.disoccluded_wrong += usize::from(wrong);
                errors.disoccluded_unmarked += usize::from(wrong && !is_marked(provenance));
            }
        }
        Ok(errors)
    }
}

fn evaluation(method: ReconstructionMethod, ms_a_view: f64, errors: &[Errors]) -> Evaluation {
    let pictures: Vec<[PictureErrors; 2]> = errors.iter().map(|e| e.pictures).collect();
    let [foreground, whole] = mean_pictures(&pictures);
    let [foreground_psnr_min_db, psnr_min_db] =
        [0, 1].map(|part| pictures.iter().map(|e| e[part].psnr_db).fold(f64::INFINITY, f64::min));
    let pixels = sum_of(errors, |e| e.depth.pixels);
    let disoccluded = sum_of(errors, |e| e.disoccluded);
    Evaluation {
        method,
        ms_a_view,
        foreground,
        foreground_psnr_min_db,
        whole,
        psnr_min_db,
        wrong_hits: sum_of(errors, |e| e.depth.wrong_hit_px) / sum_of(errors, |e| e.depth.hit_px),
        unknown: sum_of(errors, |e| e.depth.unknown_px) / pixels,
        disoccluded_wrong: sum_of(errors, |e| e.disoccluded_wrong) / disoccluded,
        disoccluded_unmarked: sum_of(errors, |e| e.disoccluded_unmarked) / disoccluded,
        disoccluded: disoccluded / pixels,
    }
}

/// The mean errors over views: over the foreground, then over whole pictures.
///
/// # Errors
/// Views differ in size, or a reference has no depth.
pub fn mean_errors(references: &[View], tests: &[View]) -> anyhow::Result<[PictureErrors; 2]> {
    let pairs = references.par_iter().zip(tests);
    let errors = pairs.map(|(reference, test)| PictureErrors::of(reference, test));
    Ok(mean_pictures(&errors.collect::<Result<Vec<_>, _>>()?))
}

fn mean_pictures(errors: &[[PictureErrors; 2]]) -> [PictureErrors; 2] {
    [0, 1].map(|part| PictureErrors {
        psnr_db: mean_of(errors, |e| e[part].psnr_db),
        ssim: mean_of(errors, |e| e[part].ssim),
        flip: mean_of(errors, |e| e[part].flip),
    })
}

/// Whether a pixel is said to be uncertain.
fn is_marked(provenance: &Provenance) -> bool {
    matches!(provenance.kind(), ProvenanceKind::Filled | ProvenanceKind::Guessed)
}

/// The depth of a view, unknown where it was filled in.
pub(crate) fn known_depth(view: &View) -> anyhow::Result<Vec<f32>> {
    let mut plane = view.inverse_depth_per_m.clone().context("a view without depth")?;
    for (inverse, provenance) in plane.iter_mut().zip(view.provenance.iter().flatten()) {
        if provenance.kind() == ProvenanceKind::Filled {
            *inverse = depth_image::HOLE_INVERSE_DEPTH;
        }
    }
    Ok(plane)
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    /// A surface in the upper half, and in it a grey.
    fn view(grey: u8) -> View {
        View {
            size_px: UVec2::splat(16),
            srgb8: (0..768).map(|byte| if byte < 384 { grey } else { 200 }).collect(),
            inverse_depth_per_m: Some((0..256).map(|pixel| if pixel < 128 { 1.0 } else { 0.0 }).collect()),
            provenance: None,
        }
    }

    #[test]
    fn mean_errors_of_the_foreground_are_free_of_empty_space() {
        let [foreground, whole] = mean_errors(&[view(100), view(100)], &[view(100), view(120)]).unwrap();
        assert!(foreground.flip > 1.5 * whole.flip && whole.flip > 0.0, "{foreground:?} {whole:?}");
        assert!(foreground.psnr_db < whole.psnr_db && foreground.ssim < whole.ssim, "{foreground:?} {whole:?}");
    }
}
