//! Single checks under other conditions: moving scenes, mirrors, an environment map, many lamps.

use std::path::Path;
use std::sync::Arc;

use depth_image::{Antialias, EnvironmentMap, Light, LightCacheQuality, ViewPlanes};
use engine::GpuEngine;
use glam::{UVec2, Vec3};
use report::{Bar, Check, PictureRow, Report};
use scene::Scene;

use super::measure::{mean_errors, picture_row};
use super::stage::{LIGHTING, REFERENCE_LIGHTING, Stage, ViewLight, antialias};
use super::subjects::{Subject, model};

const VIEWS: usize = 2;
/// Moments of a moving scene, over its period.
const MOMENTS: usize = 8;
const LAMPS: usize = 40;
const MAP_PX: UVec2 = UVec2::new(64, 32);

/// A scene, and what is special about it.
#[derive(Debug, Clone, Copy)]
pub struct Condition {
    pub name: &'static str,
    scene: &'static str,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// Each moment has samples of its own.
    Moving,
    Mirrors,
    /// A model in place of a built-in scene, under a sky with a bright sun.
    MappedModel,
    ManyLamps,
}

/// The views of all moments against direct drawing.
struct Compared {
    least_psnr_db: f64,
    pictures: Option<PictureRow>,
}

pub const CONDITIONS: [Condition; 5] = [
    Condition { name: "snake, moving", scene: "snake", kind: Kind::Moving },
    Condition { name: "tree-terrain-125k-wind, moving", scene: "tree-terrain-125k-wind", kind: Kind::Moving },
    Condition { name: "mirror-hall, 2 reflections", scene: "mirror-hall", kind: Kind::Mirrors },
    Condition { name: "lamborghini, environment map", scene: "lamborghini", kind: Kind::MappedModel },
    Condition { name: "courtyard, 40 lamps", scene: "courtyard", kind: Kind::ManyLamps },
];

impl Condition {
    /// Adds a check of the worst moment's PSNR, and the last moment's picture.
    ///
    /// # Errors
    /// The folder lacks the model, or the device fails.
    pub fn add_to(&self, report: &mut Report, engine: &Arc<GpuEngine>, models: Option<&Path>) -> anyhow::Result<()> {
        let is_moving = self.kind == Kind::Moving;
        let quality = if is_moving { LightCacheQuality::Fast } else { LightCacheQuality::Balanced };
        let bar = Bar::AtLeast(if is_moving { 34.0 } else { 36.0 });
        let name = format!("`{quality}`, {}: least PSNR", self.name);
        let scene = match (self.kind, models) {
            (Kind::MappedModel, Some(folder)) => model(folder, self.scene)?,
            (Kind::MappedModel, None) => {
                report.checks.push(Check::not_run(name, "dB", bar, "--models is not given"));
                return Ok(());
            }
            _ => self.scene.parse()?,
        };
        let compared = self.compare(engine, &Subject::outside(self.name, scene), quality)?;
        report.pictures.extend(compared.pictures);
        report.checks.push(Check::new(name, compared.least_psnr_db, "dB", bar));
        Ok(())
    }

    fn compare(
        &self,
        engine: &Arc<GpuEngine>,
        subject: &Subject,
        quality: LightCacheQuality,
    ) -> anyhow::Result<Compared> {
        let setup = subject.load()?;
        let mut scene = setup.scene.clone();
        match self.kind {
            Kind::MappedModel => scene = scene.surrounded_by(sky()?),
            Kind::ManyLamps => scene.illumination.lights = lamps(&scene),
            Kind::Moving | Kind::Mirrors => {}
        }
        let mirrors = if self.kind == Kind::Mirrors { ", reflections 2" } else { "" };
        let lighting = format!("{LIGHTING}{mirrors}").parse()?;
        let reference = ViewLight::Direct(format!("{REFERENCE_LIGHTING}{mirrors}").parse()?);
        let antialias = if self.kind == Kind::Moving { Antialias::NONE } else { antialias() };
        let moments = if self.kind == Kind::Moving { MOMENTS } else { 1 };
        let mut stage = Stage::new(engine, &scene, subject.viewpoints(&setup, VIEWS)?)?;
        let mut compared = Compared { least_psnr_db: f64::INFINITY, pictures: None };
        for moment in 0..moments {
            stage.scene_time_s = scene.period_s().unwrap_or(0.0) * moment as f32 / moments as f32;
            let cache = stage.cache(lighting)?;
            let planes = ViewPlanes { antialias, ..ViewPlanes::WITH_DEPTH };
            let cached = ViewLight::Cached { cache: &cache, lighting, quality };
            let expected = stage.draw(reference, &stage.viewpoints.views, planes)?;
            let views = stage.draw(cached, &stage.viewpoints.views, planes)?;
            let [psnr_db, _] = mean_errors(&expected, &views)?;
            tracing::info!(condition = self.name, moment, psnr_db, "compared");
            compared.least_psnr_db = compared.least_psnr_db.min(psnr_db);
            compared.pictures = Some(picture_row(self.name, &expected[0], &views[0])?);
        }
        Ok(compared)
    }
}

/// A blue sky over brown ground, with a sun of a few texels.
fn sky() -> anyhow::Result<EnvironmentMap> {
    let sun = UVec2::new(40, 8);
    let mut radiance_linear = Vec::new();
    for row in 0..MAP_PX.y {
        for column in 0..MAP_PX.x {
            let is_sun = (column.abs_diff(sun.x)).max(row.abs_diff(sun.y)) <= 1;
            let blue = Vec3::new(0.3, 0.5, 0.9);
            let brown = Vec3::new(0.15, 0.12, 0.08);
            let plain = if row < MAP_PX.y / 2 { blue } else { brown };
            radiance_linear.push(if is_sun { Vec3::splat(60.0) } else { plain });
        }
    }
    Ok(EnvironmentMap::new(MAP_PX, &radiance_linear)?)
}

/// Lamps of three colours in a grid over the scene.
fn lamps(scene: &Scene) -> Vec<Light> {
    const COLUMNS: usize = 8;
    let bounds = scene.bounds();
    let lamp = |number: usize| {
        let place = Vec3::new((number % COLUMNS) as f32 / 7.0, 1.0, (number / COLUMNS) as f32 / 4.0);
        let mut intensity_linear = Vec3::splat(0.15);
        intensity_linear[number % 3] = 0.3;
        let position_in_world = bounds.min + bounds.size() * (0.3 + 0.4 * place) + Vec3::Y;
        Light::Point { position_in_world, intensity_linear, radius_m: 0.1 }
    };
    (0..LAMPS).map(lamp).collect()
}
