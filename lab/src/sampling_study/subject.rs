//! One scene and the triangle of viewpoints that it is sampled from.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::setup::SceneArgs;
use depth_image::{Antialias, DepthImage, PinholeCamera};
use engine::GpuEngine;
use glam::{UVec2, Vec2, Vec3};
use render::{DrawWork, GpuScene, Lighting, SamplePlanes, Visibility};
use sampling::{Rig, SampleWork, Sampler, SamplingMethod};

use super::methods::IMAGES;
use crate::failures::stand::{pinholes, work};

/// The paper's scenes, as this project makes them.
pub const SCENES: [&str; 4] = ["bird-nest", "grass", "urban", "tree"];
/// Half the angle between neighbouring viewpoints, seen from the scene's middle.
const SPREAD_RAD: f32 = 0.12;
/// The distance of the viewpoints, over that from which all of the scene is in view.
const CLOSER: f32 = 0.6;
/// The direction towards the viewpoints: from the side and above.
const BACKWARDS: Vec3 = Vec3::new(0.35, 0.65, 1.0);
/// The least height of a viewpoint over the scene's middle, in diagonals of the scene: far viewpoints are not under the ground.
const LEAST_HEIGHT: f32 = 0.08;
/// The number of frames that are drawn at once.
const FRAMES_AT_ONCE: usize = 4;

/// A scene on the device.
pub struct Subject {
    /// The name of the scene.
    pub name: String,
    rig: Rig,
    diagonal_m: f32,
    pub(super) engine: Arc<GpuEngine>,
    pub(super) scene: Arc<GpuScene>,
    sampler: Sampler,
}

/// The same rig, closer and higher.
fn raised(rig: &Rig) -> Rig {
    let distance_m = (rig.center_in_world - rig.target_in_world).length() * CLOSER;
    let backwards = BACKWARDS.normalize_or(Vec3::Z);
    let right = Vec3::Y.cross(backwards).normalize_or(Vec3::X);
    let half_m = rig.half_edges_in_world[0].length() * CLOSER;
    Rig {
        center_in_world: rig.target_in_world + backwards * distance_m,
        half_edges_in_world: [right * half_m, backwards.cross(right) * half_m],
        near_m: distance_m * 0.05,
        ..*rig
    }
}

/// The corners of the triangle, in halves of the rig's edges.
const CORNERS: [Vec2; IMAGES] = [Vec2::new(-1.0, -1.0), Vec2::new(1.0, -1.0), Vec2::new(0.0, 1.0)];

impl Subject {
    /// Loads a scene by its name.
    ///
    /// # Errors
    /// The scene cannot be used, or the device fails.
    pub fn load(engine: &Arc<GpuEngine>, name: &str) -> anyhow::Result<Self> {
        let args = SceneArgs::new(fixtures::spec(name).with_context(|| name.to_owned())?);
        let setup = args.load()?;
        let hash = setup.offer.hash.to_string();
        engine.put_scene(&hash, &setup.scene)?;
        let bounds = setup.scene.bounds();
        let rig = raised(&Rig::in_front_of(&bounds, SPREAD_RAD).with_context(|| name.to_owned())?);
        let scene = engine.scene(&hash)?;
        let engine = engine.clone();
        let sampler = Sampler::sharing(engine.renderer.clone());
        Ok(Self { name: name.to_owned(), rig, diagonal_m: bounds.size().length(), engine, scene, sampler })
    }

    /// The distance of the two lower viewpoints, in diagonals of the scene.
    pub fn viewpoint_distance(&self) -> f32 {
        2.0 * self.rig.half_edges_in_world[0].length() / self.diagonal_m
    }

    /// The same scene, with viewpoints that are `factor` times as far apart.
    pub fn spread_by(&self, factor: f32) -> Self {
        let half_edges_in_world = self.rig.half_edges_in_world.map(|half| half * factor);
        let mut center_in_world = self.rig.center_in_world;
        let lowest_m = center_in_world.y - half_edges_in_world[1].y;
        let least_m = self.rig.target_in_world.y + LEAST_HEIGHT * self.diagonal_m;
        center_in_world.y += (least_m - lowest_m).max(0.0);
        Self {
            name: self.name.clone(),
            rig: Rig { center_in_world, half_edges_in_world, ..self.rig },
            engine: self.engine.clone(),
            scene: self.scene.clone(),
            sampler: Sampler::sharing(self.engine.renderer.clone()),
            ..*self
        }
    }

    /// The sample cameras of a method.
    pub fn cameras(&self, method: SamplingMethod, size_px: UVec2) -> Vec<PinholeCamera> {
        method.cameras(CORNERS.iter().map(|&corner| self.rig.camera_at(corner, size_px)).collect())
    }

    /// Views spread over the triangle between the viewpoints (R2, folded).
    pub fn between(&self, count: usize, size_px: UVec2) -> Vec<PinholeCamera> {
        const STEP: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);
        let cameras = (0..count).map(|i| {
            let p = (Vec2::splat(0.5) + STEP * i as f32).fract();
            let p = if p.x + p.y > 1.0 { Vec2::ONE - p } else { p };
            let place = CORNERS[0] + (CORNERS[1] - CORNERS[0]) * p.x + (CORNERS[2] - CORNERS[0]) * p.y;
            self.rig.camera_at(place, size_px)
        });
        cameras.collect()
    }

    pub(super) fn work(&self) -> DrawWork<'_> {
        DrawWork { visibility: Visibility::Measured, ..work(&self.scene, Lighting::UNLIT) }
    }

    /// Images of a method with the planes that are asked for.
    ///
    /// # Errors
    /// The device fails.
    pub fn sample(
        &self,
        method: SamplingMethod,
        size_px: UVec2,
        planes: SamplePlanes,
    ) -> anyhow::Result<Vec<DepthImage>> {
        let cameras = pinholes(&self.cameras(method, size_px));
        let wanted: Vec<u32> = (0..cameras.len() as u32).collect();
        let work = SampleWork { draw: self.work(), cameras: &cameras, tile_count: 1, wanted: &wanted, method, planes };
        Ok(self.sampler.sample(&work)?)
    }

    /// Draws views with surface ids, a few at a time.
    ///
    /// # Errors
    /// The device or `each` fails.
    pub fn each_frame(
        &self,
        cameras: &[PinholeCamera],
        mut each: impl FnMut(&[DepthImage]) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let planes = SamplePlanes { surface_id: true, ..SamplePlanes::default() };
        for cameras in cameras.chunks(FRAMES_AT_ONCE) {
            each(&self.engine.renderer.draw_depth_images(self.work(), &pinholes(cameras), planes)?)?;
        }
        Ok(())
    }
}

/// The planes that all metrics by pixel need.
pub(super) const WITH_IDS: SamplePlanes = SamplePlanes {
    antialias: Antialias::NONE,
    normal: false,
    surface_id: true,
    specular: false,
    corners: false,
    light: false,
};
