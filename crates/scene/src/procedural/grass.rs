//! A patch of meadow: many layers of thin blades.

use std::f32::consts::TAU;
use std::fmt;

use glam::{Vec2, Vec3};

use super::parts::{MeshBuilder, Noise, Rng, lerp, matt, mix, vertex};
use crate::{Environment, Material, Scene, Vertex};

/// Number of triangles at density 1, that of the model in the paper's table 1.
const TRIANGLES: f64 = 56_000.0;
/// The inverse of the ground's share of the triangles.
const GROUND_SHARE: u32 = 14;
const SEED: u64 = 56;
const HALF_WIDTH_M: f32 = 2.0;
/// Width of a blade at density 1.
const BLADE_WIDTH_M: f32 = 0.017;
/// Width of a blade at each of its sections, as a share of that at the root; the last one is the tip.
const TAPER: [f32; 4] = [0.8, 1.0, 0.7, 0.0];
const TRIANGLES_OF_BLADE: u32 = 2 * (TAPER.len() as u32 - 1) - 1;

/// Density of a meadow, in units of 56,000 triangles; see [`grass`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrassDensity(f32);

// Never NaN.
impl Eq for GrassDensity {}

impl GrassDensity {
    /// The default density.
    pub const ONE: Self = Self(1.0);
    /// A few blades: 56 triangles.
    pub const MIN: f32 = 0.001;
    /// 56 million triangles. Thinner blades would lose the distance of their two sides in `f32`.
    pub const MAX: f32 = 1000.0;

    /// A density between [`Self::MIN`] and [`Self::MAX`]; `None` otherwise.
    #[must_use]
    pub fn new(density: f32) -> Option<Self> {
        (Self::MIN..=Self::MAX).contains(&density).then_some(Self(density))
    }

    /// Squares of ground a side, and blades.
    fn plan(self) -> [u32; 2] {
        let triangles = (TRIANGLES * f64::from(self.0)).round() as u32;
        let cells = f64::from(triangles / GROUND_SHARE / 2).sqrt().round().max(1.0) as u32;
        [cells, triangles.saturating_sub(2 * cells * cells) / TRIANGLES_OF_BLADE]
    }

    /// Number of triangles of the meadow, before it is made.
    #[must_use]
    pub fn triangles(self) -> u64 {
        let [cells, blades] = self.plan();
        u64::from(2 * cells * cells) + u64::from(blades) * u64::from(TRIANGLES_OF_BLADE)
    }

    /// Number of vertices of the meadow, before it is made.
    #[must_use]
    pub fn vertices(self) -> u64 {
        let [cells, blades] = self.plan();
        u64::from((cells + 1) * (cells + 1)) + u64::from(blades) * u64::from(TRIANGLES_OF_BLADE + 2)
    }
}

impl fmt::Display for GrassDensity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Bent, two-sided blades of grass on an undulating patch of 4 m × 4 m around the origin: 56,000 triangles times
/// `density`. Twice as many blades are each half as wide and equally high. They cover the same share of the ground at
/// every density, only finer.
#[must_use]
pub fn grass(density: GrassDensity) -> Scene {
    let [cells, blades] = density.plan();
    let meadow = Meadow { noise: Noise::new(SEED), width_m: BLADE_WIDTH_M / density.0 };
    let mut builder = MeshBuilder::default();
    meadow.add_ground(&mut builder, cells);
    builder.finish_part(0);
    let mut rng = Rng::new(SEED, 1);
    (0..blades).for_each(|i| meadow.add_blade(&mut builder, spread(i), &mut rng));
    builder.finish_part(1);
    let materials = vec![matt("ground"), Material { double_sided: true, ..matt("blades") }];
    let scene = builder.into_scene_of("grass", materials);
    Scene { background: Environment::uniform(Vec3::new(0.46, 0.60, 0.80)), ..scene }
}

/// Places spread evenly over the unit square for any number of them: the R2 sequence (Roberts 2018).
fn spread(number: u32) -> Vec2 {
    let steps = [0.754_877_666_246_693, 0.569_840_290_998_053];
    Vec2::from(steps.map(|step: f64| (0.5 + step * f64::from(number)).fract() as f32))
}

struct Meadow {
    noise: Noise,
    width_m: f32,
}

impl Meadow {
    fn height_m(&self, at: Vec2) -> f32 {
        0.22 * self.noise.fractal(at * 0.45 + 3.0, 3) + 0.02 * self.noise.at(at * 4.0)
    }

    fn add_ground(&self, builder: &mut MeshBuilder, cells: u32) {
        builder.grid(cells, |column, row| {
            let at = Vec2::new(column as f32, row as f32) * (2.0 * HALF_WIDTH_M / cells as f32) - HALF_WIDTH_M;
            let step_m = 0.03;
            let slope =
                |axis: Vec2| (self.height_m(at + axis * step_m) - self.height_m(at - axis * step_m)) / (2.0 * step_m);
            let normal = Vec3::new(-slope(Vec2::X), 1.0, -slope(Vec2::Y)).normalize_or(Vec3::Y);
            let mould = 0.5 + 0.5 * self.noise.fractal(at * 7.0, 3);
            let earth = mix(Vec3::new(58.0, 50.0, 30.0), Vec3::new(98.0, 88.0, 48.0), mould);
            let color = mix(earth, Vec3::new(70.0, 88.0, 34.0), 0.35 + 0.4 * mould);
            vertex(Vec3::new(at.x, self.height_m(at), at.y), normal, color)
        });
    }

    fn add_blade(&self, builder: &mut MeshBuilder, in_square: Vec2, rng: &mut Rng) {
        let jitter = Vec2::new(rng.between(-0.03, 0.03), rng.between(-0.03, 0.03));
        let at = ((in_square * 2.0 - 1.0) * HALF_WIDTH_M + jitter)
            .clamp(Vec2::splat(-HALF_WIDTH_M), Vec2::splat(HALF_WIDTH_M));
        let blade = Blade::sprouting(self, at, rng);
        let first = builder.vertices.len() as u32;
        let tip = TAPER.len() as u32 - 1;
        for section in 0..tip {
            builder.push(blade.vertex(section as usize, -1.0));
            builder.push(blade.vertex(section as usize, 1.0));
        }
        builder.push(blade.vertex(tip as usize, 0.0));
        for section in 0..tip - 1 {
            let left = first + 2 * section;
            builder.quad([left, left + 1, left + 3, left + 2]);
        }
        builder.indices.extend([first + 2 * tip - 2, first + 2 * tip - 1, first + 2 * tip]);
    }
}

/// A blade that bends over its flat side.
struct Blade {
    root: Vec3,
    height_m: f32,
    width_m: f32,
    /// Horizontal and of unit length.
    lean: Vec3,
    /// Displacement of the tip, as a share of the height.
    bend: f32,
    color_srgb: Vec3,
}

impl Blade {
    fn sprouting(meadow: &Meadow, at: Vec2, rng: &mut Rng) -> Self {
        // 0 where it is lush, 1 where it is dry.
        let dryness = 0.5 + 0.6 * meadow.noise.fractal(at * 0.9 + 30.0, 3);
        let dryness = (dryness + rng.between(-0.25, 0.25)).clamp(0.0, 1.0);
        let growth = 0.85 + 0.45 * meadow.noise.fractal(at * 1.3 + 60.0, 3);
        // Most blades lean in any direction, all a little with the wind.
        let heading = Vec2::from_angle(rng.between(0.0, TAU)) + Vec2::new(0.45, 0.2);
        let heading = heading.normalize_or(Vec2::X);
        let lush = mix(Vec3::new(86.0, 134.0, 44.0), Vec3::new(134.0, 176.0, 70.0), rng.unit());
        let dry = mix(Vec3::new(176.0, 172.0, 88.0), Vec3::new(216.0, 204.0, 132.0), rng.unit());
        Self {
            root: Vec3::new(at.x, meadow.height_m(at) - 0.01, at.y),
            height_m: growth * rng.between(0.2, 0.46),
            width_m: meadow.width_m * rng.between(0.7, 1.3),
            lean: Vec3::new(heading.x, 0.0, heading.y),
            bend: rng.between(0.1, 0.8),
            color_srgb: mix(lush, dry, dryness * dryness),
        }
    }

    /// A vertex on the left (-1), the right (1) or the axis (0) of a section.
    fn vertex(&self, section: usize, side: f32) -> Vertex {
        let t = section as f32 / (TAPER.len() - 1) as f32;
        let across = Vec3::Y.cross(self.lean);
        let axis = Vec3::Y * (t - 0.35 * self.bend * t * t) + self.lean * (self.bend * t * t);
        let along = Vec3::Y * (1.0 - 0.7 * self.bend * t) + self.lean * (2.0 * self.bend * t);
        let flat = across.cross(along).normalize_or(self.lean);
        // Normals are rounded across the blade and turned up a little, which makes the meadow one surface.
        let normal = (flat + across * (0.4 * side) + Vec3::Y * 0.5).normalize_or(Vec3::Y);
        let position = self.root + axis * self.height_m + across * (0.5 * self.width_m * TAPER[section] * side);
        let color = self.color_srgb * lerp(0.55, 1.15, t);
        Vertex { sway: t * t, uv: [0.5 + 0.5 * side, 1.0 - t], ..vertex(position, normal, color) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_grow_with_density_as_predicted() {
        for density in [0.001, 0.01, 0.3, 1.0, 4.0] {
            let density = GrassDensity::new(density).unwrap();
            let scene = grass(density);
            assert_eq!(scene.triangle_count(), density.triangles());
            assert_eq!(scene.meshes[0].vertices.len() as u64, density.vertices());
            let expected = TRIANGLES * f64::from(density.0);
            assert!((density.triangles() as f64 - expected).abs() <= 7.0 + 0.002 * expected, "{density}");
        }
    }

    #[test]
    fn eight_million_triangles_are_eight_times_one_million() {
        let triangles = |density| GrassDensity::new(density).unwrap().triangles() as f64;
        assert!((triangles(144.0) / triangles(18.0) - 8.0).abs() < 1e-3);
        assert!(triangles(144.0) > 8e6 && triangles(GrassDensity::MAX) < 57e6);
    }

    #[test]
    fn blades_cover_the_same_share_at_every_density() {
        let area_m2 = |density| {
            let mesh = &grass(GrassDensity::new(density).unwrap()).meshes[0];
            let corner = |i: u32| Vec3::from(mesh.vertices[i as usize].position);
            let blades = &mesh.indices[mesh.parts[0].index_count as usize..];
            let double = |t: &[u32]| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length();
            blades.chunks_exact(3).map(double).sum::<f32>() * 0.5
        };
        let coarse = area_m2(1.0);
        let fine = area_m2(4.0);
        assert!((fine / coarse - 1.0).abs() < 0.03, "{coarse} and {fine} m²");
    }

    #[test]
    fn invalid_densities_are_none() {
        for density in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-9, 1000.1] {
            assert_eq!(GrassDensity::new(density), None, "{density}");
        }
    }
}
