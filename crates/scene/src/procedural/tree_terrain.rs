//! The paper's scene (Lages et al.): "one highly tessellated tree over a heightfield terrain", about 500 thousand
//! triangles under a simple Phong shader. It lies in their block between two planes.

use glam::{Affine3A, Vec2, Vec3};

use super::parts::{MeshBuilder, Noise, Rng, TreePlan, lerp, matt, mix, tree_mesh, vertex};
use super::random::smoothstep;
use crate::light_rig::SOFT_SUN_RAD;
use crate::{Environment, Illumination, Instance, Light, Material, Mesh, Scene, Wind};

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

/// The hilly meadow, a heightfield over x, z in [-1, 1]. Heights are in metres above y = 0; between 0 and 0.3.
struct Terrain {
    noise: Noise,
    tree_foot: Vec2,
    seed: u64,
}

impl Terrain {
    fn new(seed: u64, tree_foot: Vec2) -> Self {
        Self { noise: Noise::new(seed ^ 0x7e44), tree_foot, seed }
    }

    /// Hills, a knoll under the tree, rocks towards the rim, and tussocks.
    fn height_m(&self, at: Vec2) -> f32 {
        let hills = 0.5 + 0.5 * self.noise.fractal(at * 1.1 + 5.0, 4);
        let knoll = (-at.distance_squared(self.tree_foot) / 0.12).exp();
        let ridges = 1.0 - self.noise.fractal(at * 3.0 + 40.0, 4).abs();
        let rockiness = smoothstep(0.0, 0.5, self.noise.at(at * 1.3 + 90.0));
        let rocks = ridges.powi(6) * smoothstep(0.55, 1.0, at.distance(self.tree_foot)) * rockiness;
        let tussocks = self.noise.fractal(at * 28.0, 2);
        (0.02 + 0.15 * hills + 0.05 * knoll + 0.07 * rocks + 0.0035 * tussocks).clamp(0.0, 0.3)
    }

    /// `cells`² squares of two triangles, in one part of material 0.
    fn mesh(&self, cells: u32) -> Mesh {
        let side = cells + 1;
        let heights: Vec<f32> =
            (0..side * side).map(|i| self.height_m(grid_point(i % side, i / side, cells))).collect();
        let mut rng = Rng::new(self.seed, 11);
        let mut builder = MeshBuilder::default();
        builder.grid(cells, |column, row| {
            let at = grid_point(column, row, cells);
            let height_m = heights[(row * side + column) as usize];
            let normal = normal_on_grid(&heights, column, row, cells);
            let color = self.color_srgb(at, height_m, normal, rng.unit());
            vertex(Vec3::new(at.x, height_m, at.y), normal, color)
        });
        builder.finish_part(0);
        builder.into_mesh()
    }

    /// sRGB codes: grass by patches, earth where it is steep or trodden, rock where steeper.
    fn color_srgb(&self, at: Vec2, height_m: f32, normal: Vec3, random: f32) -> Vec3 {
        let patches = 0.5 + 0.5 * self.noise.fractal(at * 3.7 + 11.0, 3);
        let blades = 0.5 + 0.5 * self.noise.fractal(at * 55.0, 2);
        let lush = mix(Vec3::new(66.0, 98.0, 34.0), Vec3::new(108.0, 132.0, 52.0), blades);
        let dry = mix(Vec3::new(132.0, 128.0, 66.0), Vec3::new(166.0, 154.0, 92.0), blades);
        let grass = mix(lush, dry, smoothstep(0.45, 0.8, patches + 1.2 * (height_m - 0.12)));
        let earth = mix(Vec3::new(92.0, 70.0, 46.0), Vec3::new(124.0, 98.0, 68.0), blades);
        let rock = mix(Vec3::new(104.0, 100.0, 94.0), Vec3::new(150.0, 145.0, 136.0), patches + 0.4 * (blades - 0.5));
        let steepness = 1.0 - normal.y + 0.05 * (blades - 0.5);
        let trodden = smoothstep(0.13, 0.04, at.distance(self.tree_foot) + 0.05 * (patches - 0.5));
        let ground = mix(grass, earth, smoothstep(0.07, 0.15, steepness).max(0.75 * trodden));
        let ground = mix(ground, rock, smoothstep(0.14, 0.26, steepness));
        let in_flower = random < 0.004 && steepness < 0.06 && patches > 0.4 && trodden < 0.1;
        let flower = lerp(0.0, 1.0, (random * 250.0).fract());
        let flower = if flower < 0.6 { Vec3::new(226.0, 204.0, 86.0) } else { Vec3::new(232.0, 228.0, 220.0) };
        if in_flower { flower } else { ground * lerp(0.93, 1.05, random) }
    }
}

/// Column along x, row along z.
fn grid_point(column: u32, row: u32, cells: u32) -> Vec2 {
    Vec2::new(column as f32, row as f32) * (2.0 / cells as f32) - 1.0
}

fn normal_on_grid(heights: &[f32], column: u32, row: u32, cells: u32) -> Vec3 {
    let height = |c: u32, r: u32| heights[(r * (cells + 1) + c) as usize];
    let [left, back] = [column, row].map(|i| i.saturating_sub(1));
    let [right, front] = [column, row].map(|i| (i + 1).min(cells));
    let cell_m = 2.0 / cells as f32;
    let slope_x = (height(right, row) - height(left, row)) / ((right - left) as f32 * cell_m);
    let slope_z = (height(column, front) - height(column, back)) / ((front - back) as f32 * cell_m);
    Vec3::new(-slope_x, 1.0, -slope_z).normalize_or(Vec3::Y)
}
