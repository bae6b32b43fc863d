//! The hilly meadow: a heightfield over x, z in [-1, 1].

use glam::{Vec2, Vec3};

use super::geometry::{MeshBuilder, vertex};
use super::random::{Noise, Rng, lerp, mix, smoothstep};
use crate::Mesh;

/// Ground heights, metres above y = 0; between 0 and 0.3.
pub(super) struct Terrain {
    noise: Noise,
    tree_foot: Vec2,
    seed: u64,
}

impl Terrain {
    pub(super) fn new(seed: u64, tree_foot: Vec2) -> Self {
        Self { noise: Noise::new(seed ^ 0x7e44), tree_foot, seed }
    }

    /// Hills, a knoll under the tree, rocks towards the rim, and tussocks.
    pub(super) fn height_m(&self, at: Vec2) -> f32 {
        let hills = 0.5 + 0.5 * self.noise.fractal(at * 1.1 + 5.0, 4);
        let knoll = (-at.distance_squared(self.tree_foot) / 0.12).exp();
        let ridges = 1.0 - self.noise.fractal(at * 3.0 + 40.0, 4).abs();
        let rockiness = smoothstep(0.0, 0.5, self.noise.at(at * 1.3 + 90.0));
        let rocks = ridges.powi(6) * smoothstep(0.55, 1.0, at.distance(self.tree_foot)) * rockiness;
        let tussocks = self.noise.fractal(at * 28.0, 2);
        (0.02 + 0.15 * hills + 0.05 * knoll + 0.07 * rocks + 0.0035 * tussocks).clamp(0.0, 0.3)
    }

    /// `cells`² squares of two triangles, in one part of material 0.
    pub(super) fn mesh(&self, cells: u32) -> Mesh {
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
