//! The subjects of the study, and the numbers of rays of direct drawing.

use depth_image::EnvironmentMap;
use glam::{UVec2, Vec3};
use scene::Scene;

use crate::lit_views::light::{Light, LightRays};
use crate::lit_views::subject::{Change, INSIDE};

/// The lighting of samples and of views that use them, unless another is given.
pub const LIGHTING: &str = "soft 16, occlusion 16";
/// Scenes that are seen from outside: models of a folder, and built-in ones.
const MODELS: [&str; 4] = ["FlightHelmet", "lamborghini", "ingenuity", "threejs-shaderball"];
const BUILT_IN: [&str; 4] = ["urban", "courtyard", "bird-nest", "tree-terrain-500k"];
pub const OUTSIDE_SCENES: usize = MODELS.len() + BUILT_IN.len();
const QUICK: [&str; 3] = ["lamborghini", "courtyard", "tree-terrain-125k"];
/// Scenes whose indirect light is measured; the quick ones come first.
const INDIRECT: [&str; 4] = ["courtyard, inside", "gallery", "urban, inside", "tree-terrain-500k"];
const QUICK_INDIRECT: usize = 2;
/// Subjects of a single check.
pub const CONDITIONS: [Condition; 5] = [
    Condition { name: "snake, moving", is_moving: true, terms: "", change: Ok },
    Condition { name: "tree-terrain-125k-wind, moving", is_moving: true, terms: "", change: Ok },
    Condition { name: "mirror-hall, 2 reflections", is_moving: false, terms: ", reflections 2", change: Ok },
    Condition { name: "lamborghini, environment map", is_moving: false, terms: "", change: under_sky },
    Condition { name: "courtyard, 40 lamps", is_moving: false, terms: "", change: with_lamps },
];

pub struct Condition {
    pub name: &'static str,
    pub is_moving: bool,
    /// Terms of the lighting beside those of all subjects.
    pub terms: &'static str,
    pub change: Change,
}

/// Rays of direct drawing at each position. The last is the reference.
pub fn direct_rays(light: Light) -> &'static [LightRays] {
    const OCCLUSION: [LightRays; 5] = [
        LightRays::new(1, 1),
        LightRays::new(2, 2),
        LightRays::new(4, 4),
        LightRays::new(8, 8),
        LightRays::new(16, 16),
    ];
    const INDIRECT: [LightRays; 7] = LightRays::up_to(LightRays::new(16, 64));
    match light {
        Light::Occlusion => &OCCLUSION,
        Light::Indirect => &INDIRECT,
    }
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
