//! Scenes, and where their views and sample cameras stand.

use std::path::Path;

use anyhow::Context as _;
use app_core::setup::{SceneArgs, Setup};
use depth_image::{PinholeCamera, ViewCell};
use glam::{UVec2, Vec3};
use render::Lighting;
use sampling::SamplingMethod;
use scene::{Scene, SceneSpec};

use crate::failures::cached_light::LitScene;
use crate::failures::stand::Stand;
use crate::models::model_named;

pub const VIEW_PX: UVec2 = UVec2::new(640, 360);
/// Views are the first places of an orbit of so many.
const PLACES: usize = 8;
/// View cells inside scenes: in the middle of a street, and in a corner of the yard.
pub const INSIDE: [Inside; 2] = [
    Inside { name: "urban, inside", eyes: [[-62.5, 1.2, 29.88], [-59.5, 2.2, 30.12]], towards: [5.0, 4.3, -60.0] },
    Inside { name: "courtyard, inside", eyes: [[-1.42, 1.0, 1.09], [-0.98, 1.4, 1.51]], towards: [1.6, -0.6, -1.7] },
];
const INSIDE_FOV_Y_RAD: f32 = 1.0;

/// A scene. After a comma the name says where viewers stand, if not in front of the scene.
pub struct Subject {
    pub name: &'static str,
    scene: SceneSpec,
}

/// A view cell inside a scene: eyes at opposite corners, and their common direction, in world space.
pub struct Inside {
    pub name: &'static str,
    eyes: [[f32; 3]; 2],
    towards: [f32; 3],
}

/// The views of a subject: the first `count` places of an orbit of eight.
#[derive(Debug, Clone, Copy)]
pub struct OrbitViews {
    pub count: usize,
    pub size_px: UVec2,
}

/// The images of a sample set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetOptions {
    pub sampling: SamplingMethod,
    /// S: one camera in the middle of the view cell, or four at its corners.
    pub images: usize,
    /// Focal length of the images over that of the views, both in pixels.
    pub density: f32,
}

/// A scene on the device, and the cameras of its views.
pub struct Stage<'s> {
    pub stand: &'s Stand,
    pub scene: Scene,
    pub lit: LitScene<'s>,
    pub views: Vec<PinholeCamera>,
    corners: Vec<PinholeCamera>,
    cell: ViewCell,
}

impl Subject {
    /// The subject of a name; `None` for a model without a folder of models.
    pub fn new(name: &'static str, models: Option<&Path>) -> anyhow::Result<Option<Self>> {
        let scene_name = name.split(',').next().unwrap_or(name);
        let mut scene = fixtures::spec(scene_name)?;
        if let SceneSpec::File(file) = &mut scene {
            let Some(folder) = models else { return Ok(None) };
            *file = model_named(folder, scene_name)?;
        }
        Ok(Some(Self { name, scene }))
    }

    /// Whether viewers stand among the surfaces that light each other.
    pub fn is_interior(&self) -> bool {
        INSIDE.iter().any(|cell| cell.name == self.name)
    }

    /// Puts the scene on the device.
    pub fn stage<'s>(&self, stand: &'s Stand, lighting: Lighting, views: OrbitViews) -> anyhow::Result<Stage<'s>> {
        let Setup { scene, around, .. } = SceneArgs::new(self.scene.clone()).load()?;
        let corners = match INSIDE.iter().find(|cell| cell.name == self.name) {
            Some(cell) => cell.corners(scene.bounds().near_m())?,
            None => around,
        };
        let cell = ViewCell::between(&corners).context("no sample cameras")?;
        let mut cameras = cell.orbit(PLACES, views.size_px);
        cameras.truncate(views.count);
        let lit = LitScene::new(stand, &scene, &lighting.to_string())?.by_faster_way(&cameras[0])?;
        Ok(Stage { stand, scene, lit, views: cameras, corners, cell })
    }
}

impl SetOptions {
    /// Four images, whose texels have a view pixel's focal length.
    pub const DEFAULT: Self = Self { sampling: SamplingMethod::CONVENTIONAL, images: 4, density: 1.0 };
}

impl Stage<'_> {
    /// The cameras of a sample set.
    pub fn sample_cameras(&self, set: SetOptions) -> Vec<PinholeCamera> {
        let cameras = match set.images {
            4 => self.corners.clone(),
            images => self.cell.nested_cameras(images, self.corners[0].size_px),
        };
        let focal_px = self.views[0].focal_px.y * set.density;
        let resized = cameras.into_iter().map(|camera| {
            let size_px = camera.size_px.as_vec2() * (focal_px / camera.focal_px.y);
            camera.resized(size_px.round().as_uvec2())
        });
        resized.collect()
    }
}

impl Inside {
    fn corners(&self, near_m: f32) -> anyhow::Result<Vec<PinholeCamera>> {
        let cameras = self.eyes.map(|eye| {
            let target = Vec3::from(eye) + Vec3::from(self.towards);
            let aimed = PinholeCamera::looking_at(eye.into(), target, Vec3::Y, INSIDE_FOV_Y_RAD, VIEW_PX);
            PinholeCamera { near_m, ..aimed }
        });
        Ok(ViewCell::between(&cameras).context("a view cell")?.grid(2, 2, VIEW_PX))
    }
}
