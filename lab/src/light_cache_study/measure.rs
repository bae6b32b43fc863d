//! Times and errors of direct drawing with few rays, and of each quality of light from samples.

use std::path::Path;

use anyhow::Context as _;
use depth_image::LightCacheQuality::{self, Balanced, Draft, Fast, Fine};
use depth_image::{PinholeCamera, View, ViewPlanes};
use glam::Quat;
use metrics::{PictureErrors, Rgb8Image, change_error_map, flip_map, foreground};
use render::Lighting;
use report::{Bar, Check, PictureRow, Point, Report, comparison_row};

use super::subjects::{Condition, LIGHTING, direct_rays};
use crate::bench::timing::in_turn;
use crate::evaluation::mean_errors;
use crate::failures::cached_light::LitScene;
use crate::failures::measures::mean;
use crate::failures::stand::Stand;
use crate::lit_views::light::{Light, LightRays, SAMPLES_A_PIXEL};
use crate::lit_views::measure::{DirectCurve, planes, true_views, unknown};
use crate::lit_views::subject::{OrbitViews, SetSize, Stage, Subject, VIEW_PX};

/// Little light beside the surfaces.
const PLAIN_LIGHTING: &str = "shadows, occlusion 1";
/// The place of direct drawing whose positions share the rays of 16 rays a pixel.
pub const SHARED: usize = 2;
const QUALITIES: [LightCacheQuality; 4] = [Draft, Fast, Balanced, Fine];
/// A look-up costs at least this share of the surfaces; less is noise of the clock.
const LEAST_LOOK_UP: f64 = 0.01;
const CONDITION_VIEWS: usize = 2;
/// Rays to a lamp and of ambient light, at each position, of the direct drawing whose flicker is compared.
const FLICKERING: LightRays = LightRays::new(4, 4);
/// Frames in which a camera turns around the middle of the scene, and the angle between them.
const FRAMES: usize = 4;
const FRAME_TURN_RAD: f32 = 0.2_f32.to_radians();

/// Measurements of a scene.
pub struct SceneResult {
    pub name: &'static str,
    /// Direct drawing, from the fewest rays to the reference.
    pub direct: Vec<Row>,
    pub qualities: Vec<Row>,
    /// The first view, `balanced`, beside the reference.
    pub pictures: PictureRow,
    /// Time of looking light up over the time of surfaces, one position a pixel, `draft`.
    pub look_up_ratio: f64,
    /// Of the views without light.
    pub unlit_ms: f64,
    /// Error of the change from frame to frame while the camera turns: of `balanced` over that of direct drawing with
    /// [`FLICKERING`] rays.
    pub flicker_ratio: Option<f64>,
}

/// A way of drawing the views. Errors are over the foreground, means over views.
pub struct Row {
    pub name: String,
    pub ms: f64,
    pub psnr_db: f64,
    pub flip: f64,
    pub truth_flip: f64,
    /// The share of surface pixels that no sample knows; `None` in direct drawing.
    pub unknown: Option<f64>,
}

pub fn measure(stand: &Stand, subject: &Subject, plan: Measuring) -> anyhow::Result<SceneResult> {
    let Measuring { lighting, view_count, runs } = plan;
    let light = Light::of(&lighting);
    let stage = subject.stage(stand, lighting, OrbitViews { count: view_count, size_px: VIEW_PX }, Ok)?;
    let ways = ways(&stage, light)?;
    let reference = direct_rays(light).len() - 1;
    let planes = planes(SAMPLES_A_PIXEL);
    let mut views = vec![Vec::new(); ways.len()];
    let places: Vec<usize> = (0..ways.len()).collect();
    let seconds = in_turn(&places, runs, |place| {
        views[place] = ways[place].1.views(&stage.views, ViewPlanes { inverse_depth: false, ..planes })?;
        Ok(())
    })?;
    let truth = true_views(&stage, &light.truth(direct_rays(light)[reference]))?;
    for (reference, truth) in views[reference].iter_mut().zip(&truth) {
        reference.inverse_depth_per_m.clone_from(&truth.inverse_depth_per_m);
    }
    let balanced = ways.iter().position(|(name, _)| *name == Balanced.to_string()).context("a quality")?;
    let flicker_ratio = match light {
        Light::Indirect => Some(flicker_ratio(&stage, &ways[reference].1, &ways[balanced].1)?),
        Light::Occlusion => None,
    };
    let mut rows: Vec<Row> = Vec::new();
    for (place, (name, lit)) in ways.into_iter().enumerate() {
        let [PictureErrors { psnr_db, flip, .. }, _] = mean_errors(&views[reference], &views[place])?;
        let truth_flip = mean_errors(&truth, &views[place])?[0].flip;
        let ms = seconds[place] * 1e3 / view_count as f64;
        let unknown = if place > reference { unknown(&lit, &stage.views)? } else { None };
        rows.push(Row { name, ms, psnr_db, flip, truth_flip, unknown });
    }
    let pictures = picture_row(subject.name, &views[reference][0], &views[balanced][0])?;
    let qualities = rows.split_off(reference + 1);
    let [unlit_s, look_up_s] = plain_seconds(&stage, runs)?;
    let look_up_ratio = (look_up_s / unlit_s - 1.0).max(LEAST_LOOK_UP);
    let unlit = stage.lit.in_light("unlit")?;
    let all_positions = in_turn(&[&unlit], runs, |way| way.views(&stage.views, planes).map(drop))?;
    let unlit_ms = all_positions[0] * 1e3 / view_count as f64;
    Ok(SceneResult { name: subject.name, direct: rows, qualities, pictures, look_up_ratio, unlit_ms, flicker_ratio })
}

/// The error of the change from frame to frame: that of views with light from samples over that of direct drawing.
fn flicker_ratio(stage: &Stage<'_>, reference: &LitScene<'_>, cached: &LitScene<'_>) -> anyhow::Result<f64> {
    let first = stage.views.first().context("a view")?;
    let middle = stage.scene.bounds().center();
    // The eye has to move: seen from one place, a pixel has one noise, whatever the direction.
    let turned = |frame: usize| {
        let turn = Quat::from_rotation_y(frame as f32 * FRAME_TURN_RAD);
        PinholeCamera {
            eye_in_world: middle + turn * (first.eye_in_world - middle),
            world_from_camera: turn * first.world_from_camera,
            ..*first
        }
    };
    let cameras: Vec<PinholeCamera> = (0..FRAMES).map(turned).collect();
    let direct = stage.lit.in_light(&Light::Indirect.lighting(FLICKERING.a_pixel()))?;
    let expected = reference.views(&cameras, planes(SAMPLES_A_PIXEL))?;
    let change_error = |lit: &LitScene<'_>| {
        let frames = lit.views(&cameras, planes(SAMPLES_A_PIXEL))?;
        let changes = expected.windows(2).zip(frames.windows(2));
        let errors = changes.map(|(expected, frames)| change_error(expected, frames));
        mean(errors.collect::<anyhow::Result<Vec<f64>>>()?).context("two frames")
    };
    Ok(change_error(cached)? / change_error(&direct)?)
}

/// The mean over the pixels that show a surface in the second frame.
fn change_error(expected: &[View], frames: &[View]) -> anyhow::Result<f64> {
    let expected_pictures = [Rgb8Image::of_view(&expected[0])?, Rgb8Image::of_view(&expected[1])?];
    let pictures = [Rgb8Image::of_view(&frames[0])?, Rgb8Image::of_view(&frames[1])?];
    let map = change_error_map(expected_pictures.each_ref(), pictures.each_ref())?;
    let is_surface = foreground(&expected[1], &pictures[1])?;
    map.mean(Some(&is_surface))?.context("a surface")
}

/// How a scene is measured.
#[derive(Debug, Clone, Copy)]
pub struct Measuring {
    pub lighting: Lighting,
    pub view_count: usize,
    /// Each way is timed this often.
    pub runs: usize,
}

/// Direct drawing with each number of rays, then light from samples of each quality.
fn ways<'s>(stage: &Stage<'s>, light: Light) -> anyhow::Result<Vec<(String, LitScene<'s>)>> {
    let mut ways = Vec::new();
    for rays in direct_rays(light) {
        let lighting = light.lighting(rays.a_pixel());
        let name = format!("direct, {} and {} rays", rays.to_lamps, rays.ambient);
        ways.push((name, stage.lit.in_light(&lighting)?));
    }
    let images = stage.lit.decoded_samples(&stage.sample_cameras(SetSize::DEFAULT))?;
    let cached = stage.lit.with_samples(&images, QUALITIES[0])?;
    ways.extend(QUALITIES.map(|quality| (quality.to_string(), cached.at_quality(quality))));
    Ok(ways)
}

impl SceneResult {
    /// Direct drawing with the most rays.
    pub fn reference(&self) -> &Row {
        &self.direct[self.direct.len() - 1]
    }

    pub fn curve(&self) -> DirectCurve {
        DirectCurve::new(self.direct.iter().map(Row::point))
    }

    /// The time of direct drawing with a quality's FLIP over the quality's, at least.
    pub fn gain(&self, row: &Row) -> f64 {
        self.curve().least_ms_at(row.truth_flip) / row.ms
    }
}

impl Row {
    /// The time of a view, and its FLIP against the truth.
    pub fn point(&self) -> Point {
        (self.ms, self.truth_flip).into()
    }
}

/// One position a pixel: without light, and with light that is looked up.
fn plain_seconds(stage: &Stage<'_>, runs: usize) -> anyhow::Result<[f64; 2]> {
    let plain = stage.lit.in_light(PLAIN_LIGHTING)?;
    let draft = plain.with_samples(&plain.decoded_samples(&stage.sample_cameras(SetSize::DEFAULT))?, Draft)?;
    let unlit = plain.in_light("unlit")?;
    let seconds = in_turn(&[&unlit, &draft], runs, |way| way.views(&stage.views, ViewPlanes::COLOR).map(drop))?;
    Ok([seconds[0], seconds[1]])
}

/// A view beside the reference, with the map of its error.
fn picture_row(title: &str, reference: &View, view: &View) -> anyhow::Result<PictureRow> {
    let flip = flip_map(&Rgb8Image::of_view(reference)?, &Rgb8Image::of_view(view)?)?;
    let [reference, view] = [reference, view].map(|view| pictures::rgb(view).context("a view is not of its size"));
    Ok(comparison_row(title, reference?, view?, &flip, None))
}

/// Compares views with direct drawing, in a moving scene at several moments, each with samples of its own.
pub fn check(stand: &Stand, condition: &Condition, models: Option<&Path>, report: &mut Report) -> anyhow::Result<()> {
    let quality = if condition.is_moving { Fast } else { Balanced };
    let bar = Bar::AtLeast(if condition.is_moving { 34.0 } else { 36.0 });
    let name = format!("`{quality}`, {}: least PSNR", condition.name);
    let Some(subject) = Subject::new(condition.name, models)? else {
        report.checks.push(Check::not_run(name, "dB", bar, "--models is not given"));
        return Ok(());
    };
    let views = OrbitViews { count: CONDITION_VIEWS, size_px: VIEW_PX };
    let mut stage = subject.stage(stand, LIGHTING.parse()?, views, condition.change)?;
    let sample_cameras = stage.sample_cameras(SetSize::DEFAULT);
    let moments = if condition.is_moving { 8 } else { 1 };
    let planes = planes(if condition.is_moving { 1 } else { SAMPLES_A_PIXEL });
    let mut least_db = f64::INFINITY;
    let mut pictures = None;
    for moment in 0..moments {
        stage.lit.scene_time_s = stage.period_s * moment as f32 / moments as f32;
        let lit = stage.lit.in_light(&format!("{LIGHTING}{}", condition.terms))?;
        let reference = stage.lit.in_light(&format!("soft 64, occlusion 64{}", condition.terms))?;
        let cached = lit.with_samples(&lit.decoded_samples(&sample_cameras)?, quality)?;
        let views = cached.views(&stage.views, planes)?;
        let expected = reference.views(&stage.views, planes)?;
        least_db = mean_errors(&expected, &views)?[0].psnr_db.min(least_db);
        pictures = Some(picture_row(condition.name, &expected[0], &views[0])?);
    }
    report.checks.push(Check::new(name, least_db, "dB", bar));
    report.pictures.extend(pictures);
    Ok(())
}
