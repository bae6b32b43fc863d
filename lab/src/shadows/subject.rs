//! A scene under one square lamp, and the view whose shadows are compared.

use std::time::Instant;

use anyhow::Context as _;
use app_core::setup::{SceneArgs, Setup};
use cluster::SceneHash;
use depth_image::{Illumination, Light, PinholeCamera, View, ViewCell, ViewPlanes};
use engine::{GpuEngine, LampSampling};
use glam::{UVec2, Vec3};
use node::{DirectWork, Engine as _, Turn};
use scene::Scene;

/// Places along a side of the lamp's grid, as in the paper.
pub const GRID_SIDE: u32 = 16;

/// A scene with a lamp above it.
pub struct Subject<'e> {
    engine: &'e GpuEngine,
    pub triangles: usize,
    hash: String,
    pub camera: PinholeCamera,
}

/// How the grid is asked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Answer {
    Rays,
    Maps {
        side_px: u32,
    },
    Samples(LampSampling),
    /// A layered cube.
    Cube {
        side: u32,
    },
}

/// Which places of the lamp each pixel sees.
pub struct LampBits {
    pub words: Vec<u32>,
    pub seconds: f64,
}

/// A square lamp, `size` times as large as one whose diagonal is that of the scene's bounding box: one diagonal above the middle of
/// the box, facing down.
fn lamp(scene: &Scene, size: f32) -> Light {
    let bounds = scene.bounds();
    let diagonal_m = bounds.size().length();
    let half_m = 0.5 * size * diagonal_m * std::f32::consts::FRAC_1_SQRT_2;
    Light::Rectangle {
        center_in_world: bounds.center() + Vec3::Y * diagonal_m,
        half_edges_in_world: [Vec3::X * half_m, Vec3::Z * half_m],
        // A surface right below is lit by about 1, whatever the lamp's size is.
        radiance_linear: Vec3::splat(std::f32::consts::PI / (size * size)),
    }
}

impl<'e> Subject<'e> {
    /// Puts a scene under a lamp of a size on the device.
    ///
    /// # Errors
    /// There is no such scene, or the device cannot hold it.
    pub fn load(engine: &'e GpuEngine, name: &str, lamp_size: f32, side_px: u32) -> anyhow::Result<Self> {
        let Setup { mut scene, around, .. } = SceneArgs::new(fixtures::spec(name)?).load()?;
        scene.illumination = Illumination { lights: vec![lamp(&scene, lamp_size)], ..Illumination::default() };
        let cell = ViewCell::between(&around).context("no sample cameras")?;
        let camera = cell.spread(1, UVec2::splat(side_px))[0];
        let hash = SceneHash::of(format!("{name}, lamp {lamp_size}").as_bytes()).to_string();
        engine.put_scene(&hash, &scene)?;
        Ok(Self { engine, triangles: scene.triangle_count() as usize, hash, camera })
    }

    /// The places of a grid that each pixel sees, and the time that it takes, with that of images of the lamp unless these are there.
    ///
    /// # Errors
    /// The device fails.
    pub fn bits(&self, answer: Answer, grid_side: u32) -> anyhow::Result<LampBits> {
        let default = LampSampling::default();
        let (word, sampling) = match answer {
            Answer::Rays => ("rays", default),
            Answer::Maps { side_px } => ("maps", LampSampling { side_px, ..default }),
            Answer::Samples(sampling) => ("samples", sampling),
            Answer::Cube { side } => ("cube", LampSampling { side_px: side, ..default }),
        };
        let lighting = format!("soft {grid_side}x{grid_side} by {word}");
        self.engine.set_lamp_sampling(sampling);
        let start = Instant::now();
        let words = self.engine.lamp_bits(&self.hash, lighting.parse()?, &self.camera)?;
        Ok(LampBits { words, seconds: start.elapsed().as_secs_f64() })
    }

    /// A view in a light, and the time that it takes.
    ///
    /// # Errors
    /// The device fails.
    pub fn view(&self, lighting: &str) -> anyhow::Result<(View, f64)> {
        let work = DirectWork {
            scene_hash: self.hash.clone(),
            cameras: vec![self.camera],
            lighting: lighting.to_owned(),
            scene_time_s: 0.0,
            planes: ViewPlanes::WITH_DEPTH,
            surfaces_by_rays: Some(true),
        };
        let start = Instant::now();
        let view = self.engine.draw_direct(&work, Turn::default())?.remove(0);
        Ok((view, start.elapsed().as_secs_f64()))
    }
}
