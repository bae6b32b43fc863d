//! The paper's scene (Lages et al.): "one highly tessellated tree over a heightfield terrain", about 500 thousand
//! triangles under a simple Phong shader. It lies in their block between two planes.

use glam::{Affine3A, Vec2, Vec3};

use super::geometry::matt;
use super::terrain::Terrain;
use super::tree::{TreePlan, tree_mesh};
use crate::light_rig::SOFT_SUN_RAD;
use crate::{Environment, Illumination, Instance, Light, Material, Scene, Wind};

/// Place of the tree, x and z.
const TREE_FOOT: Vec2 = Vec2::new(-0.05, 0.04);
/// Top of the block.
const CEILING_M: f32 = 0.98;
const TREE_HEIGHT_M: f32 = 0.8;

/// A blue sky over a meadow that reflects some of it: `(0.20, 0.23, 0.27)` on level ground.
const ENVIRONMENT: Environment = Environment::gradient(Vec3::new(0.220, 0.258, 0.312), Vec3::new(0.10, 0.09, 0.06));

/// A tree on a hilly meadow of 2 m × 2 m, within x, z in [-1, 1] and y in [0, 1]. Half of the triangles are ground and
/// half are tree. The count is met within 3 % from some 10,000 triangles up. The scene is static: see
/// [`Scene::with_wind`].
#[must_use]
pub fn tree_terrain(triangles: u32, seed: u64) -> Scene {
    let cells = (f64::from(triangles) / 4.0).sqrt().round().max(1.0) as u32;
    let terrain = Terrain::new(seed, TREE_FOOT);
    let foot_y_m = terrain.height_m(TREE_FOOT);
    let plan = TreePlan {
        // The roots reach a little into the ground, which slopes.
        foot_in_world: Vec3::new(TREE_FOOT.x, foot_y_m - 0.012, TREE_FOOT.y),
        height_m: TREE_HEIGHT_M.min(CEILING_M - foot_y_m),
        triangles: triangles.saturating_sub(2 * cells * cells),
    };
    let meshes = vec![terrain.mesh(cells), tree_mesh(&plan, seed)];
    Scene {
        name: format!("tree-terrain-{triangles}"),
        instances: (0..2).map(|mesh| Instance { mesh, world_from_mesh: Affine3A::IDENTITY }).collect(),
        meshes,
        materials: materials(),
        illumination: Illumination { lights: lights(), environment: ENVIRONMENT },
        background: Environment::uniform(Vec3::new(0.40, 0.56, 0.80)),
        ..Scene::default()
    }
}

impl Scene {
    /// Adds a breeze that moves vertices with sway by up to a fortieth of a metre. A scene without sway in its vertices
    /// stays at rest.
    #[must_use]
    pub fn with_wind(mut self) -> Self {
        self.wind = Some(Wind {
            direction_in_world: Vec3::new(0.96, 0.0, 0.28),
            amplitude_m: 0.025,
            frequency_hz: 0.45,
            waves_per_m: Vec3::new(0.9, 0.35, 0.5),
        });
        self
    }
}

/// All materials are matt under GGX, leaves too. The paper's scene then has no view-dependent light, and its samples
/// need no planes for it. The paper's highlights belong to `phong` lighting.
fn materials() -> Vec<Material> {
    let [ground, bark, leaves] = [("ground", 0.02, 8.0), ("bark", 0.05, 12.0), ("leaves", 0.10, 20.0)]
        .map(|(name, phong_specular, phong_exponent)| Material { phong_specular, phong_exponent, ..matt(name) });
    vec![ground, bark, Material { double_sided: true, ..leaves }]
}

/// A late sun, and a weak lamp on the shaded side. The lamp appears twice as wide as the sun from the tree, because a
/// fill light should cast no distinct shadows.
fn lights() -> Vec<Light> {
    vec![
        Light::Directional {
            towards_light_in_world: Vec3::new(0.48, 0.64, 0.6),
            irradiance_linear: Vec3::new(0.98, 0.90, 0.74),
            angular_radius_rad: SOFT_SUN_RAD,
        },
        Light::Point {
            position_in_world: Vec3::new(-0.9, 0.95, -0.6),
            intensity_linear: Vec3::new(0.08, 0.10, 0.14),
            radius_m: 0.1,
        },
    ]
}
