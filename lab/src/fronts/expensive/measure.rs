//! All rows of a subject under one lighting.

use gpu::Turn;
use std::time::Instant;

use depth_image::{DepthImage, PinholeCamera, View, ViewPlanes};
use metrics::PictureErrors;
use reconstruction::{ReconstructRequest, ReconstructionMethod, SampleSet, SetDescription};

use super::rows::{DIRECT_RAYS, Drawing, LightRow, QUALITIES, sets};
use super::subjects::{is_interior, lighting};
use crate::evaluation::mean_errors;
use crate::failures::cached_light::LitScene;
use crate::failures::stand::Stand;
use crate::lit_views::light::{Light, LightRays, SAMPLES_A_PIXEL};
use crate::lit_views::measure::{DirectCurve, planes, true_views, unknown};
use crate::lit_views::subject::{OrbitViews, SetSize, Stage, Subject};
use crate::reference_views::encoded_and_decoded;
use crate::statistics::median;

/// The most rays to a lamp and of ambient light at a position; true views have twice as many.
const MOST_RAYS: LightRays = LightRays::new(16, 64);
/// The density of a set that is sampled before each set that is timed, since the first of a kind compiles shaders.
const WARM_UP_DENSITY: f32 = 0.0625;
/// The side of a view that does not count, over that of the others.
const WARM_UP_SIDE_RATIO: f32 = 0.25;

/// A subject's rows under one lighting.
pub struct LightFront {
    /// The subject and the lighting.
    pub name: String,
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
    set: Option<SetSize>,
    sampling_s: f64,
    drawer: Drawer<'s>,
}

/// Decoded images of a set, and the time of sampling it.
struct TimedImages {
    images: Vec<DepthImage>,
    sampling_s: f64,
}

impl LightFront {
    /// Measures all rows; calls `done` after each.
    ///
    /// # Errors
    /// The scene cannot be used, or the device fails.
    pub fn measure(
        stand: &Stand,
        subject: &Subject,
        light: Light,
        views: OrbitViews,
        mut done: impl FnMut(),
    ) -> anyhow::Result<Self> {
        let lighting = lighting(light);
        let stage = subject.stage(stand, lighting.parse()?, views, Ok)?;
        let truth_lighting = light.truth(MOST_RAYS);
        let truth = true_views(&stage, &truth_lighting)?;
        let mut rows = Vec::new();
        for row in open_rows(&stage, light)? {
            rows.push(row.measure(&stage, &truth)?);
            done();
        }
        let name = format!("{}, {lighting}", subject.name);
        Ok(Self { name, light, is_interior: is_interior(subject.name), truth: truth_lighting, rows })
    }

    pub fn direct(&self) -> DirectCurve {
        let direct = self.rows.iter().filter(|row| matches!(row.drawing, Drawing::Direct(_)));
        DirectCurve::new(direct.map(LightRow::point))
    }

    /// Whether every row that is as fast has a greater error.
    pub fn is_on_front(&self, row: &LightRow) -> bool {
        let beats = |other: &LightRow| {
            let is_better = other.view_ms < row.view_ms || other.flip < row.flip;
            other.view_ms <= row.view_ms && other.flip <= row.flip && is_better
        };
        !self.rows.iter().any(beats)
    }
}

/// Samples the scene once for each set.
fn open_rows<'s>(stage: &Stage<'s>, light: Light) -> anyhow::Result<Vec<OpenRow<'s>>> {
    let mut rows = Vec::new();
    for rays in DIRECT_RAYS {
        let lit = stage.lit.in_light(&light.lighting(rays.a_pixel()))?;
        rows.push(OpenRow { drawing: Drawing::Direct(rays), set: None, sampling_s: 0.0, drawer: Drawer::Scene(lit) });
    }
    for set in sets() {
        let TimedImages { images, sampling_s } = TimedImages::sample(stage, set, |cameras| stage.lit.samples(cameras))?;
        let cached = stage.lit.with_samples(&images, QUALITIES[0])?;
        rows.extend(QUALITIES.map(|quality| {
            let drawer = Drawer::Scene(cached.at_quality(quality));
            OpenRow { drawing: Drawing::LightCache(quality), set: Some(set), sampling_s, drawer }
        }));
    }
    rows.push(joint_carve(stage)?);
    Ok(rows)
}

fn joint_carve<'s>(stage: &Stage<'s>) -> anyhow::Result<OpenRow<'s>> {
    let set = SetSize::DEFAULT;
    let TimedImages { images, sampling_s } =
        TimedImages::sample(stage, set, |cameras| stage.lit.color_samples(cameras))?;
    let description = SetDescription {
        volume: stage.scene.bounds(),
        background: stage.scene.background,
        illumination: &stage.scene.illumination,
        highlight: None,
        environment: None,
        mips: false,
    };
    let images = stage.stand.reconstructor().upload(&images, &description, Turn::default())?;
    let drawer = Drawer::Images(stage.stand, Box::new(images));
    Ok(OpenRow { drawing: Drawing::JointCarve, set: Some(set), sampling_s, drawer })
}

impl TimedImages {
    fn sample(
        stage: &Stage<'_>,
        set: SetSize,
        sample: impl Fn(&[PinholeCamera]) -> anyhow::Result<Vec<DepthImage>>,
    ) -> anyhow::Result<Self> {
        sample(&stage.sample_cameras(SetSize { density: WARM_UP_DENSITY, ..set }))?;
        let cameras = stage.sample_cameras(set);
        let start = Instant::now();
        let images = sample(&cameras)?;
        let sampling_s = start.elapsed().as_secs_f64();
        let images = images.iter().map(encoded_and_decoded).collect::<anyhow::Result<_>>()?;
        Ok(Self { images, sampling_s })
    }
}

impl Drawer<'_> {
    fn view(&self, camera: &PinholeCamera, planes: ViewPlanes) -> anyhow::Result<View> {
        let cameras = std::slice::from_ref(camera);
        let mut views = match self {
            Self::Scene(lit) => lit.views(cameras, planes)?,
            Self::Images(stand, set) => {
                let method = ReconstructionMethod::JointCarve { stop_level: 0 };
                stand
                    .reconstructor()
                    .reconstruct(ReconstructRequest { planes, ..ReconstructRequest::new(set, cameras, method) })?
            }
        };
        Ok(views.remove(0))
    }
}

impl OpenRow<'_> {
    /// Draws the views one after the other, after a small one that does not count.
    fn measure(self, stage: &Stage<'_>, truth: &[View]) -> anyhow::Result<LightRow> {
        let planes = ViewPlanes { inverse_depth: false, ..planes(SAMPLES_A_PIXEL) };
        let first = &stage.views[0];
        self.drawer.view(&first.resized((first.size_px.as_vec2() * WARM_UP_SIDE_RATIO).as_uvec2()), planes)?;
        let mut views = Vec::with_capacity(stage.views.len());
        let mut views_s = Vec::with_capacity(stage.views.len());
        for camera in &stage.views {
            let start = Instant::now();
            views.push(self.drawer.view(camera, planes)?);
            views_s.push(start.elapsed().as_secs_f64());
        }
        let [PictureErrors { psnr_db, flip, .. }, _] = mean_errors(truth, &views)?;
        let unknown = match (&self.drawing, &self.drawer) {
            (Drawing::LightCache(_), Drawer::Scene(lit)) => unknown(lit, &stage.views)?,
            _ => None,
        };
        Ok(LightRow {
            drawing: self.drawing,
            set: self.set,
            view_ms: median(views_s) * 1e3,
            sampling_s: self.sampling_s,
            flip,
            psnr_db,
            unknown,
        })
    }
}
