//! Views from cubes: errors, loads and time.

use depth_image::{View, ViewPlanes};
use metrics::{PictureErrors, depth_errors};
use reconstruction::{ReconstructRequest, ReconstructionMethod, SampleSet};

use super::subject::Subject;
use crate::statistics::median_seconds;

pub const LAYERED: ReconstructionMethod = ReconstructionMethod::LAYERED;
/// Times that a batch of views is made; the median counts.
const REPEATS: usize = 5;

/// Means over views of a scene, and the seconds of a view.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    pub psnr_db: f64,
    pub flip: f64,
    pub wrong_hits: f64,
    pub missed: f64,
    /// Nodes and samples that a ray of the paper's ways loads; the walk does not count.
    pub loads: Option<f64>,
    pub view_s: f64,
}

/// Views of a subject by walking through a cube.
///
/// # Errors
/// The device fails.
pub fn of_cube(subject: &Subject<'_>, set: &SampleSet) -> anyhow::Result<Figures> {
    let views = made(subject, set)?;
    let reconstructor = subject.stand.reconstructor();
    let request = ReconstructRequest::new(set, &subject.views, LAYERED);
    let view_s = seconds_a_view(|| Ok(reconstructor.reconstruct(request)?))?;
    figures(&subject.truths, &views, view_s)
}

/// The median seconds of a view of a batch, after a run that makes shaders.
///
/// # Errors
/// `make` fails.
pub fn seconds_a_view(make: impl Fn() -> anyhow::Result<Vec<View>>) -> anyhow::Result<f64> {
    let mut count = 1;
    let batch_s = median_seconds(REPEATS, || {
        let views = make()?;
        count = views.len().max(1);
        Ok(views)
    })?;
    Ok(batch_s / count as f64)
}

/// Views of a subject by walking through a cube, with depth.
///
/// # Errors
/// The device fails.
pub fn made(subject: &Subject<'_>, set: &SampleSet) -> anyhow::Result<Vec<View>> {
    let request = ReconstructRequest::new(set, &subject.views, LAYERED);
    Ok(subject.stand.reconstructor().reconstruct(ReconstructRequest { planes: ViewPlanes::WITH_DEPTH, ..request })?)
}

/// The figures of views beside the truth.
///
/// # Errors
/// Views differ in size.
pub fn figures(truths: &[View], views: &[View], view_s: f64) -> anyhow::Result<Figures> {
    let mut all = Figures { psnr_db: 0.0, flip: 0.0, wrong_hits: 0.0, missed: 0.0, loads: None, view_s };
    for (truth, view) in truths.iter().zip(views) {
        let [foreground, _] = PictureErrors::of(truth, view)?;
        let depths = [truth, view].map(|view| view.inverse_depth_per_m.as_deref().unwrap_or_default());
        let depth = depth_errors(depths[0], depths[1])?;
        let share = 1.0 / truths.len() as f64;
        all.psnr_db += share * foreground.psnr_db;
        all.flip += share * foreground.flip;
        all.wrong_hits += share * depth.wrong_hit_rate.unwrap_or(0.0);
        all.missed += share * (depth.wrong_miss_px + depth.unknown_px) as f64 / depth.foreground_px.max(1) as f64;
    }
    Ok(all)
}
