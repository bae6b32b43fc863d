//! The subjects of the study: scenes, and where their views and sample cameras stand.

use std::path::Path;

use anyhow::Context as _;
use app_core::exit::BadInput;
use app_core::setup::{SceneArgs, Setup};
use depth_image::{EnvironmentMap, PinholeCamera, ViewCell};
use glam::{UVec2, Vec3};
use render::Lighting;
use sampling::Impostors;
use scene::{Scene, SceneSpec};

use super::light::Light;
use crate::failures::cached_light::LitScene;
use crate::failures::stand::Stand;
use crate::models::models_of;

/// The lighting of samples and of views that use them, unless another is given.
pub const LIGHTING: &str = "soft 16, occlusion 16";
pub const VIEW_PX: UVec2 = UVec2::new(640, 360);
/// Views are the first places of an orbit of so many.
const PLACES: usize = 8;
/// Scenes that are seen from outside: models of a folder, and built-in ones.
const MODELS: [&str; 4] = ["FlightHelmet", "lamborghini", "ingenuity", "threejs-shaderball"];
const BUILT_IN: [&str; 4] = ["urban", "courtyard", "bird-nest", "tree-terrain-500k"];
pub const OUTSIDE_SCENES: usize = MODELS.len() + BUILT_IN.len();
const QUICK: [&str; 3] = ["lamborghini", "courtyard", "tree-terrain-125k"];
/// Scenes whose indirect light is measured; the quick ones come first.
const INDIRECT: [&str; 4] = ["courtyard, inside", "gallery", "urban, inside", "tree-terrain-500k"];
const QUICK_INDIRECT: usize = 2;
/// View cells inside scenes: in the middle of a street, and in a corner of the yard.
const INSIDE: [Inside; 2] = [
    Inside { name: "urban, inside", eyes: [[-62.5, 1.2, 29.88], [-59.5, 2.2, 30.12]], towards: [5.0, 4.3, -60.0] },
    Inside { name: "courtyard, inside", eyes: [[-1.42, 1.0, 1.09], [-0.98, 1.4, 1.51]], towards: [1.6, -0.6, -1.7] },
];
const INSIDE_FOV_Y_RAD: f32 = 1.0;
/// Subjects of a single check.
pub const CONDITIONS: [Condition; 5] = [
    Condition { name: "snake, moving", is_moving: true, terms: "", change: Ok },
    Condition { name: "tree-terrain-125k-wind, moving", is_moving: true, terms: "", change: Ok },
    Condition { name: "mirror-hall, 2 reflections", is_moving: false, terms: ", reflections 2", change: Ok },
    Condition { name: "lamborghini, environment map", is_moving: false, terms: "", change: under_sky },
    Condition { name: "courtyard, 40 lamps", is_moving: false, terms: "", change: with_lamps },
];

/// A scene. The name says after a comma what is special about the subject, if anything is.
pub struct Subject {
    pub name: &'static str,
    scene: SceneSpec,
}

/// A view cell inside a scene: eyes at opposite corners, and their common direction, in world space.
struct Inside {
    name: &'static str,
    eyes: [[f32; 3]; 2],
    towards: [f32; 3],
}

type Change = fn(Scene) -> anyhow::Result<Scene>;

pub struct Condition {
    pub name: &'static str,
    pub is_moving: bool,
    /// Terms of the lighting beside those of all subjects.
    pub terms: &'static str,
    pub change: Change,
}

/// A scene on the device, and the cameras of its views and of the samples that serve them.
pub struct Stage<'s> {
    pub lit: LitScene<'s>,
    pub period_s: f32,
    pub views: Vec<PinholeCamera>,
    pub samples: Vec<PinholeCamera>,
}

/// The scenes that are compared with direct drawing.
pub fn scene_names(light: Light, is_quick: bool) -> Vec<&'static str> {
    let inside = INSIDE.map(|cell| cell.name);
    match (light, is_quick) {
        (Light::Indirect, true) => INDIRECT[..QUICK_INDIRECT].to_vec(),
        (Light::Indirect, false) => INDIRECT.to_vec(),
        (Light::Occlusion, true) => QUICK.to_vec(),
        (Light::Occlusion, false) => [&MODELS[..], &BUILT_IN, &inside].concat(),
    }
}

impl Subject {
    /// The subject of a name; `None` for a model without a folder of models.
    pub fn new(name: &'static str, models: Option<&Path>) -> anyhow::Result<Option<Self>> {
        let scene_name = name.split(',').next().unwrap_or(name);
        let mut scene = scene_name.parse()?;
        if let SceneSpec::File(file) = &mut scene {
            let Some(folder) = models else { return Ok(None) };
            let mut models = models_of(folder, usize::MAX)?.into_iter();
            let model = models.find(|model| model.file_stem().is_some_and(|stem| stem == scene_name));
            *file = model.ok_or_else(|| BadInput(format!("{}: no model {scene_name}", folder.display())))?;
        }
        Ok(Some(Self { name, scene }))
    }

    /// Puts the scene on the device. A texel of its four sample images has a view pixel's focal length.
    pub fn stage<'s>(
        &self,
        stand: &'s Stand,
        lighting: Lighting,
        view_count: usize,
        change: Change,
    ) -> anyhow::Result<Stage<'s>> {
        let args = SceneArgs { impostors: Impostors::None, ..SceneArgs::new(self.scene.clone()) };
        let Setup { scene, mut around, .. } = args.load()?;
        if let Some(cell) = INSIDE.iter().find(|cell| cell.name == self.name) {
            around = cell.corners(scene.bounds().near_m())?;
        }
        let mut views = ViewCell::between(&around).context("no sample cameras")?.orbit(PLACES, VIEW_PX);
        views.truncate(view_count);
        for camera in &mut around {
            let size_px = camera.size_px.as_vec2() * (views[0].focal_px.y / camera.focal_px.y);
            *camera = camera.resized(size_px.round().as_uvec2());
        }
        let period_s = scene.period_s().unwrap_or(0.0);
        let lit = LitScene::new(stand, &change(scene)?, &lighting.to_string())?.by_faster_way(&views[0])?;
        Ok(Stage { lit, period_s, views, samples: around })
    }
}

impl Inside {
    fn corners(&self, near_m: f32) -> anyhow::Result<Vec<PinholeCamera>> {
        let camera = |eye: [f32; 3]| {
            let target = Vec3::from(eye) + Vec3::from(self.towards);
            let aimed = PinholeCamera::looking_at(eye.into(), target, Vec3::Y, INSIDE_FOV_Y_RAD, VIEW_PX);
            PinholeCamera { near_m, ..aimed }
        };
        Ok(ViewCell::between(&self.eyes.map(camera)).context("a view cell")?.grid(2, 2, VIEW_PX))
    }
}

/// A blue sky over brown ground, with a sun of nine texels.
fn under_sky(scene: Scene) -> anyhow::Result<Scene> {
    let mut texels = [[Vec3::new(0.3, 0.5, 0.9); 1024], [Vec3::new(0.15, 0.12, 0.08); 1024]].concat();
    for row in 7..=9 {
        texels[64 * row + 39..][..3].fill(Vec3::splat(60.0));
    }
    Ok(scene.surrounded_by(EnvironmentMap::new(UVec2::new(64, 32), &texels)?))
}

/// Lamps of three colours in a grid over the scene.
fn with_lamps(mut scene: Scene) -> anyhow::Result<Scene> {
    let bounds = scene.bounds();
    scene.illumination.lights.clear();
    for number in 0..40 {
        let place = Vec3::new((number % 8) as f32 / 7.0, 1.0, (number / 8) as f32 / 4.0);
        let position_in_world = bounds.min + bounds.size() * (0.3 + 0.4 * place) + Vec3::Y;
        let mut intensity_linear = Vec3::splat(0.15);
        intensity_linear[number % 3] = 0.3;
        scene.illumination.lights.push(depth_image::Light::Point {
            position_in_world,
            intensity_linear,
            radius_m: 0.1,
        });
    }
    Ok(scene)
}
