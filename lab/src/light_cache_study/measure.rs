//! Times and errors of direct drawing with few rays, and of each quality of light from samples.

use std::sync::Arc;

use anyhow::Context as _;
use depth_image::{Antialias, LightCacheQuality, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use engine::GpuEngine;
use metrics::{PSNR_CAP_DB, Rgb8Image, flip_map, foreground, psnr_db};
use rayon::prelude::*;
use render::{LightCache, Lighting};
use report::{PictureRow, comparison_row};

use super::stage::{LIGHTING, SAMPLES_A_PIXEL, Stage, TimedViews, ViewLight, antialias};
use super::subjects::Subject;

/// Rays to a lamp and of occlusion at each position, in direct drawing.
pub const DIRECT_RAYS: [u32; 5] = [1, 2, 4, 8, 16];
/// The place in [`DIRECT_RAYS`] of direct drawing under [`LIGHTING`], whose rays the positions of a pixel share.
pub const SHARED: usize = 2;
/// The place of direct drawing with all rays of [`LIGHTING`] at each position: the reference.
pub const REFERENCE: usize = DIRECT_RAYS.len() - 1;
/// Twice the rays of the reference.
const TRUTH_LIGHTING: &str = "soft 128, occlusion 128";
pub const QUALITIES: [LightCacheQuality; 4] =
    [LightCacheQuality::Draft, LightCacheQuality::Fast, LightCacheQuality::Balanced, LightCacheQuality::Fine];
/// The place in [`QUALITIES`] of the quality that the report shows.
const SHOWN: usize = 2;
/// One ray to a lamp and one of occlusion: little light beside the surfaces.
const PLAIN_LIGHTING: &str = "shadows, occlusion 1";
/// A look-up costs at least this share of the surfaces; less is noise of the clock.
const LEAST_LOOK_UP: f64 = 0.01;

/// Measurements of a scene.
pub struct SceneResult {
    pub name: String,
    pub is_outside: bool,
    /// Direct drawing with each of [`DIRECT_RAYS`].
    pub direct: Vec<Row>,
    /// Each of [`QUALITIES`].
    pub qualities: Vec<Row>,
    /// The first view, `balanced`, beside the reference.
    pub pictures: PictureRow,
    /// Time of looking light up over the time of surfaces, one position a pixel, `draft`.
    pub look_up_ratio: f64,
}

/// One way of making the views.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub name: String,
    pub ms: f64,
    /// Against the reference, as `flip`. Errors are over the foreground, means over views.
    pub psnr_db: f64,
    pub flip: f64,
    pub truth_flip: f64,
    /// The share of surface pixels that no sample knows; 0 in direct drawing, which asks none.
    pub unknown: f64,
}

/// A gain at equal FLIP over direct drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    pub ratio: f64,
    /// No direct row reaches the FLIP: the gain is more than the ratio.
    pub is_lower_bound: bool,
}

/// The size of a measurement.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    pub views: usize,
    /// The first of the views, which are compared with the truth.
    pub truth_views: usize,
}

/// Measures a scene.
///
/// # Errors
/// The scene cannot be loaded, or the device fails.
pub fn measure(engine: &Arc<GpuEngine>, subject: &Subject, extent: Extent) -> anyhow::Result<SceneResult> {
    let setup = subject.load()?;
    let stage = Stage::new(engine, &setup.scene, subject.viewpoints(&setup, extent.views)?)?;
    let lighting: Lighting = LIGHTING.parse()?;
    let cache = stage.cache(lighting)?;
    let timed = stage.timed(&lights(&cache, lighting)?, antialias())?;
    let reference = with_depth(&stage, timed[REFERENCE].views.clone())?;
    let truth = truth(&stage, extent.truth_views)?;
    let row = |name: String, timed: &TimedViews, unknown: f64| {
        let [psnr_db, flip] = mean_errors(&reference, &timed.views)?;
        let [_, truth_flip] = mean_errors(&truth, &timed.views)?;
        anyhow::Ok(Row { name, ms: timed.ms, psnr_db, flip, truth_flip, unknown })
    };
    let (timed_direct, timed_cached) = timed.split_at(DIRECT_RAYS.len());
    let mut direct = Vec::new();
    for (rays, timed) in DIRECT_RAYS.iter().zip(timed_direct) {
        direct.push(row(format!("direct, {rays} rays"), timed, 0.0)?);
    }
    let mut qualities = Vec::new();
    for (quality, timed) in QUALITIES.into_iter().zip(timed_cached) {
        qualities.push(row(quality.to_string(), timed, unknown_share(&stage, &cache, quality)?)?);
    }
    Ok(SceneResult {
        name: subject.name.clone(),
        is_outside: subject.pose.is_none(),
        pictures: picture_row(&subject.name, &reference[0], &timed_cached[SHOWN].views[0])?,
        direct,
        qualities,
        look_up_ratio: look_up_ratio(&stage)?,
    })
}

/// All rows: each of [`DIRECT_RAYS`], then each of [`QUALITIES`].
fn lights(cache: &LightCache, lighting: Lighting) -> anyhow::Result<Vec<ViewLight<'_>>> {
    let mut lights = Vec::new();
    for rays in DIRECT_RAYS {
        let pixel_rays = rays * SAMPLES_A_PIXEL;
        lights.push(ViewLight::Direct(format!("soft {pixel_rays}, occlusion {pixel_rays}").parse()?));
    }
    lights.extend(QUALITIES.map(|quality| ViewLight::Cached { cache, lighting, quality }));
    Ok(lights)
}

/// A view beside the reference, with the map of its error.
pub fn picture_row(title: &str, reference: &View, view: &View) -> anyhow::Result<PictureRow> {
    let flip = flip_map(&Rgb8Image::of_view(reference)?, &Rgb8Image::of_view(view)?)?;
    let [reference, view] = [reference, view].map(pictures::rgb);
    let sizes = "a view's colours do not fit its size";
    Ok(comparison_row(title, reference.context(sizes)?, view.context(sizes)?, &flip, None))
}

/// The views with the depth of their surfaces, which tells the foreground.
fn with_depth(stage: &Stage, mut views: Vec<View>) -> anyhow::Result<Vec<View>> {
    let unlit = stage.draw(ViewLight::Direct(Lighting::UNLIT), &stage.viewpoints.views, ViewPlanes::WITH_DEPTH)?;
    for (view, unlit) in views.iter_mut().zip(unlit) {
        view.inverse_depth_per_m = unlit.inverse_depth_per_m;
    }
    Ok(views)
}

/// Seeds are made from the bits of the camera's eye: from the next place in x the picture is the same, and its noise another.
fn truth(stage: &Stage, count: usize) -> anyhow::Result<Vec<View>> {
    let next = |camera: &PinholeCamera| PinholeCamera {
        eye_in_world: camera.eye_in_world.with_x(camera.eye_in_world.x.next_up()),
        ..*camera
    };
    let cameras: Vec<PinholeCamera> = stage.viewpoints.views.iter().take(count).map(next).collect();
    let planes = ViewPlanes { antialias: antialias(), ..ViewPlanes::WITH_DEPTH };
    stage.draw(ViewLight::Direct(TRUTH_LIGHTING.parse()?), &cameras, planes)
}

fn look_up_ratio(stage: &Stage) -> anyhow::Result<f64> {
    let lighting = PLAIN_LIGHTING.parse()?;
    let cache = stage.cache(lighting)?;
    let draft = ViewLight::Cached { cache: &cache, lighting, quality: LightCacheQuality::Draft };
    let timed = stage.timed(&[ViewLight::Direct(Lighting::UNLIT), draft], Antialias::NONE)?;
    Ok((timed[1].ms / timed[0].ms - 1.0).max(LEAST_LOOK_UP))
}

/// The share of surface pixels whose light no sample knows. It does not depend on the rays of the view.
fn unknown_share(stage: &Stage, cache: &LightCache, quality: LightCacheQuality) -> anyhow::Result<f64> {
    let light = ViewLight::Cached { cache, lighting: PLAIN_LIGHTING.parse()?, quality };
    let views = stage.draw(light, &stage.viewpoints.views, ViewPlanes::WITH_PROVENANCE)?;
    let kinds = || views.iter().flat_map(|view| view.provenance.iter().flatten()).map(|origin| origin.kind());
    let surfaces = kinds().filter(|&kind| kind != ProvenanceKind::Empty).count();
    let unknown = kinds().filter(|&kind| kind == ProvenanceKind::LitHere).count();
    Ok(unknown as f64 / surfaces.max(1) as f64)
}

/// PSNR and FLIP over the foreground, means over the views that have a reference.
///
/// # Errors
/// Views differ in size, or show no surface.
pub fn mean_errors(references: &[View], views: &[View]) -> anyhow::Result<[f64; 2]> {
    let errors = |(reference, view): (&View, &View)| {
        let (expected, actual) = (Rgb8Image::of_view(reference)?, Rgb8Image::of_view(view)?);
        let mask = foreground(reference, &actual)?;
        let psnr_db = psnr_db(&expected, &actual, Some(&mask))?.context("a view of no surface")?;
        let flip = flip_map(&expected, &actual)?.mean(Some(&mask))?.context("a view of no surface")?;
        anyhow::Ok([psnr_db.min(PSNR_CAP_DB), flip])
    };
    let pairs = references.par_iter().zip(views);
    let errors = pairs.map(errors).collect::<anyhow::Result<Vec<_>>>()?;
    Ok([0, 1].map(|which| errors.iter().map(|errors| errors[which]).sum::<f64>() / errors.len() as f64))
}

impl SceneResult {
    /// The time of direct drawing with the fewest rays that reach the row's FLIP, over the row's time.
    pub fn gain(&self, row: &Row) -> Gain {
        let flip = row.truth_flip;
        let Some(place) = self.direct.iter().position(|direct| direct.truth_flip <= flip) else {
            let last_ms = self.direct.last().map_or(f64::NAN, |last| last.ms);
            return Gain { ratio: last_ms / row.ms, is_lower_bound: true };
        };
        let after = &self.direct[place];
        let before = &self.direct[place.saturating_sub(1)];
        let change = (before.truth_flip / after.truth_flip).ln();
        let share = if change > 0.0 { (before.truth_flip / flip).ln() / change } else { 1.0 };
        let direct_ms = before.ms * (after.ms / before.ms).powf(share);
        Gain { ratio: direct_ms / row.ms, is_lower_bound: false }
    }

    /// The quality with the greatest gain, and the gain.
    pub fn best_quality(&self) -> Option<(&Row, Gain)> {
        let gains = self.qualities.iter().map(|row| (row, self.gain(row)));
        gains.max_by(|a, b| a.1.ratio.total_cmp(&b.1.ratio))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(ms: f64, truth_flip: f64) -> Row {
        Row { name: String::new(), ms, psnr_db: 40.0, flip: truth_flip, truth_flip, unknown: 0.0 }
    }

    #[test]
    fn gains_compare_with_the_fewest_rays_that_reach_the_flip() {
        let direct = vec![row(100.0, 0.04), row(200.0, 0.02), row(400.0, 0.01)];
        let pictures = PictureRow { title: String::new(), pictures: Vec::new() };
        let name = String::new();
        let result =
            SceneResult { name, is_outside: true, direct, qualities: Vec::new(), pictures, look_up_ratio: 0.0 };
        let gain = |flip| result.gain(&row(50.0, flip));
        assert_eq!(gain(0.05), Gain { ratio: 2.0, is_lower_bound: false }, "one ray is better already");
        assert!((gain(0.02_f64.sqrt() * 0.01_f64.sqrt()).ratio - 4.0 * 2.0_f64.sqrt()).abs() < 1e-9);
        assert_eq!(gain(0.005), Gain { ratio: 8.0, is_lower_bound: true });
    }
}
