//! The scenes of the study, and where their views and sample cameras stand.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use app_core::exit::BadInput;
use app_core::setup::{SceneArgs, Setup};
use depth_image::{PinholeCamera, ViewCell};
use glam::{UVec2, Vec2, Vec3};
use sampling::Impostors;
use scene::SceneSpec;

use crate::bench::fronts::models_of;

/// Columns and rows of a view.
pub const VIEW_PX: UVec2 = UVec2::new(640, 360);
const MODELS: [&str; 4] = ["FlightHelmet", "lamborghini", "ingenuity", "threejs-shaderball"];
const BUILT_IN: [&str; 4] = ["urban", "courtyard", "bird-nest", "tree-terrain-500k"];
/// The models and built-in scenes of the quick form.
const QUICK_MODELS: [&str; 1] = ["lamborghini"];
const QUICK_BUILT_IN: [&str; 2] = ["courtyard", "tree-terrain-125k"];
/// Scenes that are seen from outside, in the full form.
pub const OUTSIDE_SCENES: usize = MODELS.len() + BUILT_IN.len();
/// Eye heights inside scenes: in the middle of a street, and in a corner of the yard.
const INSIDE: [(&str, Pose); 2] = [
    (
        "urban",
        Pose {
            eye_in_world: Vec3::new(-61.0, 1.7, 30.0),
            target_in_world: Vec3::new(-56.0, 6.0, -30.0),
            half_edges_m: Vec2::new(1.5, 0.5),
        },
    ),
    (
        "courtyard",
        Pose {
            eye_in_world: Vec3::new(-1.2, 1.2, 1.3),
            target_in_world: Vec3::new(0.4, 0.6, -0.4),
            half_edges_m: Vec2::new(0.3, 0.2),
        },
    ),
];
const POSE_FOV_Y_RAD: f32 = 1.0;

/// A scene and how it is seen.
#[derive(Debug, Clone)]
pub struct Subject {
    pub name: String,
    pub scene: SceneSpec,
    /// The place of an eye inside the scene; without one the scene is seen from outside.
    pub pose: Option<Pose>,
}

/// A place inside a scene.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    eye_in_world: Vec3,
    target_in_world: Vec3,
    /// Half the width and height of the view cell about the eye.
    half_edges_m: Vec2,
}

/// Cameras of views, and of the samples that serve the views.
pub struct Viewpoints {
    pub views: Vec<PinholeCamera>,
    pub samples: Vec<PinholeCamera>,
}

impl Subject {
    /// A scene that is seen from outside.
    pub fn outside(name: &str, scene: SceneSpec) -> Self {
        Self { name: name.to_owned(), scene, pose: None }
    }

    /// Loads the scene.
    pub fn load(&self) -> anyhow::Result<Setup> {
        let args = SceneArgs { impostors: Impostors::None, ..SceneArgs::new(self.scene.clone()) };
        args.load().with_context(|| self.name.clone())
    }

    /// `count` views on an orbit within the view cell, and its four sample cameras. A texel has a view pixel's focal length.
    pub fn viewpoints(&self, setup: &Setup, count: usize) -> anyhow::Result<Viewpoints> {
        let corners = self.pose.map_or_else(|| setup.around.clone(), |pose| pose.corners(setup));
        let views = ViewCell::between(&corners).context("no sample cameras")?.orbit(count, VIEW_PX);
        let view = views.first().context("no views")?;
        let fitted = |camera: PinholeCamera| {
            let size_px = camera.size_px.as_vec2() * (view.focal_px.y / camera.focal_px.y);
            camera.resized(size_px.round().as_uvec2())
        };
        Ok(Viewpoints { samples: corners.into_iter().map(fitted).collect(), views })
    }
}

impl Pose {
    /// Cameras at the corners of the cell, in rows from the bottom left.
    fn corners(self, setup: &Setup) -> Vec<PinholeCamera> {
        let middle =
            PinholeCamera::looking_at(self.eye_in_world, self.target_in_world, Vec3::Y, POSE_FOV_Y_RAD, VIEW_PX);
        let right = middle.world_from_camera * Vec3::X * self.half_edges_m.x;
        let corner = |[x, y]: [f32; 2]| PinholeCamera {
            eye_in_world: middle.eye_in_world + right * x + Vec3::Y * (self.half_edges_m.y * y),
            near_m: setup.scene.bounds().near_m(),
            ..middle
        };
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].map(corner).to_vec()
    }
}

/// The scenes that are compared with direct drawing.
///
/// # Errors
/// The folder lacks a model.
pub fn subjects(models: Option<&Path>, is_quick: bool) -> anyhow::Result<Vec<Subject>> {
    let model_names: &[&str] = if is_quick { &QUICK_MODELS } else { &MODELS };
    let built_in: &[&str] = if is_quick { &QUICK_BUILT_IN } else { &BUILT_IN };
    let mut subjects = Vec::new();
    if let Some(folder) = models {
        for name in model_names {
            subjects.push(Subject::outside(name, model(folder, name)?));
        }
    }
    for name in built_in {
        subjects.push(Subject::outside(name, name.parse()?));
    }
    let inside: &[(&str, Pose)] = if is_quick { &[] } else { &INSIDE };
    for (name, pose) in inside {
        subjects.push(Subject { name: format!("{name}, inside"), scene: name.parse()?, pose: Some(*pose) });
    }
    Ok(subjects)
}

/// The model of this name in a folder.
///
/// # Errors
/// The folder lacks it.
pub fn model(folder: &Path, name: &str) -> anyhow::Result<SceneSpec> {
    let is_named = |path: &PathBuf| path.file_stem().is_some_and(|stem| stem == name);
    let found = models_of(folder, usize::MAX)?.into_iter().find(is_named);
    let missing = || BadInput(format!("{}: no model {name}", folder.display()));
    Ok(SceneSpec::File(found.ok_or_else(missing)?))
}
