//! Reconstructed views against reference views, pixel by pixel.

use anyhow::Context as _;
use depth_image::{Provenance, ProvenanceKind, View, ViewPlanes};
use metrics::{PictureErrors, PixelClass, Rgb8Image, depth_errors};
use rayon::prelude::*;
use reconstruction::ReconstructionMethod;

use crate::reference_views::ReferenceViews;

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
    /// Over the pixels that show a surface; mean over views.
    pub foreground_psnr_db: f64,
    /// As `foreground_psnr_db`.
    pub foreground_flip: f64,
    /// As `foreground_psnr_db`.
    pub foreground_ssim: f64,
    /// As `foreground_psnr_db`, of the worst view.
    pub foreground_psnr_min_db: f64,
    /// Mean over views.
    pub psnr_db: f64,
    /// The worst view.
    pub psnr_min_db: f64,
    /// Mean over views.
    pub ssim: f64,
    /// Mean over views.
    pub flip: f64,
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

/// Errors of one view, to be added up.
#[derive(Debug, Clone, Copy, Default)]
struct Errors {
    foreground_psnr_db: f64,
    foreground_flip: f64,
    foreground_ssim: f64,
    psnr_db: f64,
    ssim: f64,
    flip: f64,
    pixels: usize,
    hits: usize,
    wrong_hits: usize,
    unknown: usize,
    disoccluded: usize,
    disoccluded_wrong: usize,
    disoccluded_unmarked: usize,
}

impl Errors {
    fn of(reference: &View, view: &View, classes: &[PixelClass]) -> anyhow::Result<Self> {
        let actual = Rgb8Image::of_view(view)?;
        let depth = depth_errors(&known_depth(reference)?, &known_depth(view)?, None)?;
        let [foreground, whole] = PictureErrors::of(reference, &actual)?;
        let errors = Self {
            foreground_psnr_db: foreground.psnr_db,
            foreground_flip: foreground.flip,
            foreground_ssim: foreground.ssim,
            psnr_db: whole.psnr_db,
            ssim: whole.ssim,
            flip: whole.flip,
            pixels: depth.pixels,
            hits: depth.hit_px,
            wrong_hits: depth.wrong_hit_px,
            unknown: depth.unknown_px,
            ..Self::default()
        };
        errors.with_disocclusions(reference, view, classes)
    }

    /// Counts disoccluded pixels, those of a wrong colour, and those of these that are not marked as filled.
    fn with_disocclusions(mut self, reference: &View, view: &View, classes: &[PixelClass]) -> anyhow::Result<Self> {
        let provenance = view.provenance.as_ref().context("a view without provenance")?;
        let colors = reference.srgb8.as_chunks::<3>().0.iter().zip(view.srgb8.as_chunks::<3>().0);
        let wrong = colors.map(|(a, b)| (0..3).any(|i| a[i].abs_diff(b[i]) > WRONG_COLOR));
        for ((class, wrong), provenance) in classes.iter().zip(wrong).zip(provenance) {
            if *class == PixelClass::Disoccluded {
                self.disoccluded += 1;
                self.disoccluded_wrong += usize::from(wrong);
                self.disoccluded_unmarked += usize::from(wrong && !is_marked(provenance));
            }
        }
        Ok(self)
    }
}

fn evaluation(method: ReconstructionMethod, ms_a_view: f64, errors: &[Errors]) -> Evaluation {
    let mean = |value: fn(&Errors) -> f64| errors.iter().map(value).sum::<f64>() / errors.len() as f64;
    let sum = |value: fn(&Errors) -> usize| errors.iter().map(value).sum::<usize>() as f64;
    Evaluation {
        method,
        ms_a_view,
        foreground_psnr_db: mean(|e| e.foreground_psnr_db),
        foreground_flip: mean(|e| e.foreground_flip),
        foreground_ssim: mean(|e| e.foreground_ssim),
        foreground_psnr_min_db: errors.iter().map(|e| e.foreground_psnr_db).fold(f64::INFINITY, f64::min),
        psnr_db: mean(|e| e.psnr_db),
        psnr_min_db: errors.iter().map(|e| e.psnr_db).fold(f64::INFINITY, f64::min),
        ssim: mean(|e| e.ssim),
        flip: mean(|e| e.flip),
        wrong_hits: sum(|e| e.wrong_hits) / sum(|e| e.hits),
        unknown: sum(|e| e.unknown) / sum(|e| e.pixels),
        disoccluded_wrong: sum(|e| e.disoccluded_wrong) / sum(|e| e.disoccluded),
        disoccluded_unmarked: sum(|e| e.disoccluded_unmarked) / sum(|e| e.disoccluded),
        disoccluded: sum(|e| e.disoccluded) / sum(|e| e.pixels),
    }
}

/// The mean errors over views: over the foreground, then over whole pictures.
///
/// # Errors
/// Views differ in size, or a reference has no depth.
pub fn mean_errors(references: &[View], tests: &[View]) -> anyhow::Result<[PictureErrors; 2]> {
    let errors = |(reference, test): (&View, &View)| PictureErrors::of(reference, &Rgb8Image::of_view(test)?);
    let errors = references.par_iter().zip(tests).map(errors).collect::<Result<Vec<_>, _>>()?;
    let mean = |part: usize| {
        let mean = |value: fn(&PictureErrors) -> f64| {
            errors.iter().map(|e| value(&e[part])).sum::<f64>() / errors.len() as f64
        };
        PictureErrors { psnr_db: mean(|e| e.psnr_db), ssim: mean(|e| e.ssim), flip: mean(|e| e.flip) }
    };
    Ok([mean(0), mean(1)])
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
