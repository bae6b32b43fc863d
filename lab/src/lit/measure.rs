//! Rows of a subject under one lighting: direct drawing, views whose light comes from samples, and views from images alone.

use std::fmt;
use std::time::Instant;

use codec::encode_depth_image;
use depth_image::{Antialias, DepthImage, LightCacheQuality, PinholeCamera, View, ViewPlanes};
use gpu::Turn;
use metrics::PictureErrors;
use reconstruction::{ReconstructRequest, SampleSet};
use render::Lighting;
use report::Point;

use super::direct::DirectCurve;
use super::light::{Light, LightRays, SAMPLES_A_PIXEL};
use super::subject::{OrbitViews, SetOptions, Stage, Subject};
use crate::evaluation::mean_errors;
use crate::failures::cached_light::{LitScene, unknown_share};
use crate::failures::measures::mean;
use crate::failures::stage::CARVE;
use crate::failures::stand::{Stand, description};
use crate::reference_views::encoded_and_decoded;
use crate::statistics::median;
use crate::study::measure_rows;

/// The density of a set that is sampled before each set that is timed, since the first of a kind compiles shaders.
const WARM_UP_DENSITY: f32 = 0.0625;
/// The side of a view that does not count, over that of the others.
const WARM_UP_SIDE_RATIO: f32 = 0.25;

/// How views are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drawing {
    /// All light is traced in the view, with these rays at each position.
    Direct(LightRays),
    LightCache(LightCacheQuality),
    JointCarve,
}

/// A measured row. Errors are over the foreground, means over views.
#[derive(Debug, Clone)]
pub struct LightRow {
    pub drawing: Drawing,
    /// `None` in direct drawing.
    pub set: Option<SetOptions>,
    /// The median of the views.
    pub view_ms: f64,
    /// What sampling took and gave; nothing in direct drawing.
    pub sampled: SamplingResult,
    pub flip: f64,
    pub psnr_db: f64,
    /// The share of surface pixels whose light no sample knows; `None` but with light from samples.
    pub unknown: Option<f64>,
}

/// A sample set.
#[derive(Debug, Clone, Copy, Default)]
pub struct SamplingResult {
    /// Of the whole set.
    pub seconds: f64,
    /// Of the whole set, encoded.
    pub bytes: usize,
    /// Texels with a sample.
    pub samples: usize,
}

/// The rows of a subject, and how they are measured.
#[derive(Debug, Clone)]
pub struct LitRows {
    /// Rays of direct drawing at each position, from the fewest on.
    pub direct: &'static [LightRays],
    pub qualities: &'static [LightCacheQuality],
    /// Sets for each quality.
    pub sets: Vec<SetOptions>,
    pub has_joint_carve: bool,
    pub views: OrbitViews,
    /// Each view is timed this often.
    pub runs: usize,
}

/// A subject's rows under one lighting.
pub struct LightFront {
    pub subject: &'static str,
    pub lighting: Lighting,
    pub light: Light,
    pub is_interior: bool,
    /// The lighting of the true views.
    pub truth: String,
    pub rows: Vec<LightRow>,
}

/// What draws views.
enum Drawer<'s> {
    Scene(LitScene<'s>),
    Images(&'s Stand, Box<SampleSet>),
}

/// A row before it is measured.
struct OpenRow<'s> {
    drawing: Drawing,
    set: Option<SetOptions>,
    sampled: SamplingResult,
    drawer: Drawer<'s>,
}

impl LitRows {
    /// Measures all rows.
    ///
    /// # Errors
    /// The scene cannot be used, or the device fails.
    pub fn measure(&self, stand: &Stand, subject: &Subject, lighting: Lighting) -> anyhow::Result<LightFront> {
        let light = Light::of(&lighting);
        let stage = subject.stage(stand, lighting, self.views)?;
        let most_rays = self.direct[self.direct.len() - 1];
        let truth_lighting = light.truth(most_rays);
        let truth = true_views(&stage, &truth_lighting)?;
        let name = format!("rows, {}, {lighting}", subject.name);
        let rows = measure_rows(&name, self.open(&stage, light)?, |row| row.measure(&stage, &truth, self.runs))?;
        let is_interior = subject.is_interior();
        Ok(LightFront { subject: subject.name, lighting, light, is_interior, truth: truth_lighting, rows })
    }

    /// Samples the scene once for each set.
    fn open<'s>(&self, stage: &Stage<'s>, light: Light) -> anyhow::Result<Vec<OpenRow<'s>>> {
        let mut rows = Vec::new();
        for &rays in self.direct {
            let drawer = Drawer::Scene(stage.lit.in_light(&light.lighting(rays.a_pixel()))?);
            rows.push(OpenRow {
                drawing: Drawing::Direct(rays),
                set: None,
                sampled: SamplingResult::default(),
                drawer,
            });
        }
        for &set in &self.sets {
            let (images, sampled) = sampled(stage, set, |cameras| stage.lit.samples_by(set.sampling, cameras))?;
            let cached = stage.lit.with_samples(&images, LightCacheQuality::Balanced)?;
            rows.extend(self.qualities.iter().map(|&quality| OpenRow {
                drawing: Drawing::LightCache(quality),
                set: Some(set),
                sampled,
                drawer: Drawer::Scene(cached.at_quality(quality)),
            }));
        }
        if self.has_joint_carve {
            rows.push(joint_carve(stage)?);
        }
        Ok(rows)
    }
}

impl LightFront {
    pub fn name(&self) -> String {
        format!("{}, {}", self.subject, self.lighting)
    }

    pub fn direct(&self) -> DirectCurve {
        let direct = self.rows.iter().filter(|row| row.is_direct());
        DirectCurve::new(direct.map(LightRow::point))
    }

    /// Whether every row that is as fast has a greater error.
    pub fn is_on_front(&self, row: &LightRow) -> bool {
        !self.rows.iter().any(|other| {
            let is_better = other.view_ms < row.view_ms || other.flip < row.flip;
            other.view_ms <= row.view_ms && other.flip <= row.flip && is_better
        })
    }

    /// The row of a quality with the default set.
    pub fn at_quality(&self, quality: LightCacheQuality) -> Option<&LightRow> {
        let mut rows = self.rows.iter();
        rows.find(|row| row.drawing == Drawing::LightCache(quality) && row.set == Some(SetOptions::DEFAULT))
    }

    /// The time of direct drawing with a row's FLIP over the row's, at least.
    pub fn gain(&self, row: &LightRow) -> f64 {
        self.direct().least_ms_at(row.flip) / row.view_ms
    }
}

impl LightRow {
    pub fn is_direct(&self) -> bool {
        matches!(self.drawing, Drawing::Direct(_))
    }

    /// Whether light comes from samples.
    pub fn is_shared(&self) -> bool {
        matches!(self.drawing, Drawing::LightCache(_))
    }

    /// The time of a view, and its FLIP.
    pub fn point(&self) -> Point {
        (self.view_ms, self.flip).into()
    }
}

impl fmt::Display for Drawing {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Direct(rays) => write!(formatter, "direct, {} and {} rays", rays.to_lamps, rays.ambient),
            Self::LightCache(quality) => write!(formatter, "light_cache:{quality}"),
            Self::JointCarve => formatter.write_str("joint_carve"),
        }
    }
}

/// The stage's views in another lighting, with other noise than direct drawing from the same cameras.
///
/// Seeds are made from the bits of a camera's eye: from the next place in x the picture is the same, and its noise another.
fn true_views(stage: &Stage<'_>, lighting: &str) -> anyhow::Result<Vec<View>> {
    let mut cameras = stage.views.clone();
    cameras.iter_mut().for_each(|camera| camera.eye_in_world.x = camera.eye_in_world.x.next_up());
    let planes = ViewPlanes { antialias: antialias(), ..ViewPlanes::WITH_DEPTH };
    stage.lit.in_light(lighting)?.views(&cameras, planes)
}

fn antialias() -> Antialias {
    Antialias::of(SAMPLES_A_PIXEL).unwrap_or_default()
}

fn joint_carve<'s>(stage: &Stage<'s>) -> anyhow::Result<OpenRow<'s>> {
    let set = SetOptions::DEFAULT;
    let (images, sampled) = sampled(stage, set, |cameras| stage.lit.color_samples(cameras))?;
    let images = stage.stand.reconstructor().upload(&images, &description(&stage.scene, None), Turn::default())?;
    let drawer = Drawer::Images(stage.stand, Box::new(images));
    Ok(OpenRow { drawing: Drawing::JointCarve, set: Some(set), sampled, drawer })
}

/// Decoded images of a set, and what sampling it took.
fn sampled(
    stage: &Stage<'_>,
    set: SetOptions,
    sample: impl Fn(&[PinholeCamera]) -> anyhow::Result<Vec<DepthImage>>,
) -> anyhow::Result<(Vec<DepthImage>, SamplingResult)> {
    sample(&stage.sample_cameras(SetOptions { density: WARM_UP_DENSITY, ..set }))?;
    let cameras = stage.sample_cameras(set);
    let start = Instant::now();
    let images = sample(&cameras)?;
    let seconds = start.elapsed().as_secs_f64();
    let depths = images.iter().flat_map(|image| &image.inverse_depth_per_m);
    let mut result = SamplingResult { seconds, bytes: 0, samples: depths.filter(|&&depth| depth > 0.0).count() };
    let mut decoded = Vec::with_capacity(images.len());
    for image in &images {
        result.bytes += encode_depth_image(image)?.payload.len();
        decoded.push(encoded_and_decoded(image)?);
    }
    Ok((decoded, result))
}

impl Drawer<'_> {
    fn view(&self, camera: &PinholeCamera, planes: ViewPlanes) -> anyhow::Result<View> {
        let cameras = std::slice::from_ref(camera);
        let mut views = match self {
            Self::Scene(lit) => lit.views(cameras, planes)?,
            Self::Images(stand, set) => {
                let request = ReconstructRequest::new(set, cameras, CARVE);
                stand.reconstructor().reconstruct(ReconstructRequest { planes, ..request })?
            }
        };
        Ok(views.remove(0))
    }
}

impl OpenRow<'_> {
    /// Draws the views one after the other, after a small one that does not count.
    fn measure(self, stage: &Stage<'_>, truth: &[View], runs: usize) -> anyhow::Result<LightRow> {
        let planes = ViewPlanes { antialias: antialias(), ..ViewPlanes::COLOR };
        let first = &stage.views[0];
        self.drawer.view(&first.resized((first.size_px.as_vec2() * WARM_UP_SIDE_RATIO).as_uvec2()), planes)?;
        let mut views = Vec::with_capacity(stage.views.len());
        let mut views_s = Vec::with_capacity(runs * stage.views.len());
        for _ in 0..runs {
            views.clear();
            for camera in &stage.views {
                let start = Instant::now();
                views.push(self.drawer.view(camera, planes)?);
                views_s.push(start.elapsed().as_secs_f64());
            }
        }
        let [PictureErrors { psnr_db, flip, .. }, _] = mean_errors(truth, &views)?;
        let unknown = match (&self.drawing, &self.drawer) {
            (Drawing::LightCache(_), Drawer::Scene(lit)) => {
                mean(lit.views(&stage.views, ViewPlanes::WITH_PROVENANCE)?.iter().map(unknown_share))
            }
            _ => None,
        };
        Ok(LightRow {
            drawing: self.drawing,
            set: self.set,
            view_ms: median(views_s) * 1e3,
            sampled: self.sampled,
            flip,
            psnr_db,
            unknown,
        })
    }
}
