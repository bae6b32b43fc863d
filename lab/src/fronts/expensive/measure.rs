//! All rows of a subject under one lighting.

use std::time::Instant;

use depth_image::{PinholeCamera, View, ViewPlanes};
use metrics::PictureErrors;
use reconstruction::{ReconstructionMethod, SampleSet, SetDescription};

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

/// A subject's rows under one lighting.
pub struct LightFront {
    /// The subject and the lighting.
    pub name: String,
    pub light: Light,
    pub is_interior: bool,
    pub rows: Vec<LightRow>,
}

/// What draws views.
enum Drawer<'s> {
    Scene(LitScene<'s>),
    Images(&'s Stand, SampleSet),
}

/// A row before it is measured.
struct OpenRow<'s> {
    drawing: Drawing,
    set: Option<SetSize>,
    sampling_s: f64,
    drawer: Drawer<'s>,
    views: Vec<View>,
    views_s: Vec<f64>,
}

impl LightFront {
    /// Measures all rows. Rows take turns, view by view, so that none has the quieter machine.
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
        let mut rows = open_rows(&stage, light)?;
        let planes = ViewPlanes { inverse_depth: false, ..planes(SAMPLES_A_PIXEL) };
        for camera in &stage.views {
            for row in &mut rows {
                let start = Instant::now();
                let view = row.drawer.view(camera, planes)?;
                row.views_s.push(start.elapsed().as_secs_f64());
                row.views.push(view);
            }
            done();
        }
        let truth = true_views(&stage, &light.truth(MOST_RAYS))?;
        done();
        let rows = rows.into_iter().map(|row| row.close(&stage, &truth)).collect::<anyhow::Result<_>>()?;
        let name = format!("{}, {lighting}", subject.name);
        Ok(Self { name, light, is_interior: is_interior(subject.name), rows })
    }

    /// Calls of `done` while a subject is measured.
    pub fn steps(views: OrbitViews) -> usize {
        views.count + 1
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
        rows.push(OpenRow::new(Drawing::Direct(rays), None, 0.0, Drawer::Scene(lit)));
    }
    for set in sets() {
        let start = Instant::now();
        let images = stage.lit.samples(&stage.sample_cameras(set))?;
        let sampling_s = start.elapsed().as_secs_f64();
        let images = images.iter().map(encoded_and_decoded).collect::<anyhow::Result<Vec<_>>>()?;
        let cached = stage.lit.with_samples(&images, QUALITIES[0])?;
        rows.extend(QUALITIES.map(|quality| {
            let drawer = Drawer::Scene(cached.at_quality(quality));
            OpenRow::new(Drawing::LightCache(quality), Some(set), sampling_s, drawer)
        }));
    }
    let start = Instant::now();
    let images = stage.lit.color_samples(&stage.sample_cameras(SetSize::DEFAULT))?;
    let sampling_s = start.elapsed().as_secs_f64();
    let images = images.iter().map(encoded_and_decoded).collect::<anyhow::Result<Vec<_>>>()?;
    let description = SetDescription {
        volume: stage.scene.bounds(),
        background: stage.scene.background,
        illumination: &stage.scene.illumination,
        highlight: None,
        environment: None,
        mips: false,
    };
    let images = stage.stand.reconstructor().upload(&images, &description)?;
    let drawer = Drawer::Images(stage.stand, images);
    rows.push(OpenRow::new(Drawing::JointCarve, Some(SetSize::DEFAULT), sampling_s, drawer));
    Ok(rows)
}

impl Drawer<'_> {
    fn view(&self, camera: &PinholeCamera, planes: ViewPlanes) -> anyhow::Result<View> {
        let cameras = std::slice::from_ref(camera);
        let mut views = match self {
            Self::Scene(lit) => lit.views(cameras, planes)?,
            Self::Images(stand, set) => {
                let method = ReconstructionMethod::JointCarve { stop_level: 0 };
                stand.reconstructor().reconstruct(set, cameras, method, planes)?
            }
        };
        Ok(views.remove(0))
    }
}

impl<'s> OpenRow<'s> {
    fn new(drawing: Drawing, set: Option<SetSize>, sampling_s: f64, drawer: Drawer<'s>) -> Self {
        Self { drawing, set, sampling_s, drawer, views: Vec::new(), views_s: Vec::new() }
    }

    fn close(self, stage: &Stage<'_>, truth: &[View]) -> anyhow::Result<LightRow> {
        let [PictureErrors { psnr_db, flip, .. }, _] = mean_errors(truth, &self.views)?;
        let unknown = match (&self.drawing, &self.drawer) {
            (Drawing::LightCache(_), Drawer::Scene(lit)) => unknown(lit, &stage.views)?,
            _ => None,
        };
        Ok(LightRow {
            drawing: self.drawing,
            set: self.set,
            view_ms: median(self.views_s) * 1e3,
            sampling_s: self.sampling_s,
            flip,
            psnr_db,
            unknown,
        })
    }
}
