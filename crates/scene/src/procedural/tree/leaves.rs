//! Leaves on the shoots and twigs.

use glam::Vec3;

use super::super::parts::{MeshBuilder, Noise, Rng, lerp, mix, vertex};
use super::skeleton::{Branch, LEVELS, Skeleton};
use crate::Vertex;

/// Area of one side of all leaves, for a tree of this size: about four layers over the crown.
const TOTAL_AREA_M2: f32 = 1.9;
const WIDTH_OF_LENGTH: f32 = 0.56;
/// Area of a leaf's outline over length times width.
const FILL: f32 = 0.62;
const MAX_LENGTH_M: f32 = 0.034;
/// Number of triangles of all leaves below which a leaf is a rhomb of two triangles instead of a folded one of six.
const FEW_TRIANGLES: u32 = 40_000;
/// Additional sway of a leaf's tip over the twig's.
const LEAF_SWAY: f32 = 0.18;

/// Adds leaves until `triangles` are used up.
pub(super) fn add(builder: &mut MeshBuilder, skeleton: &Skeleton, triangles: u32, seed: u64) {
    let is_folded = triangles >= FEW_TRIANGLES;
    let count = triangles / if is_folded { 6 } else { 2 };
    let length_m = (TOTAL_AREA_M2 / (count.max(1) as f32 * FILL * WIDTH_OF_LENGTH)).sqrt().min(MAX_LENGTH_M);
    let twigs: Vec<&Branch> = skeleton.branches.iter().filter(|b| b.level + 2 >= LEVELS).collect();
    let noise = Noise::new(seed ^ 0x1eaf);
    let mut rng = Rng::new(seed, 3);
    for i in 0..count as usize {
        // Leaves are spread evenly over the twigs for any count.
        let twig = twigs[(i as u64 * twigs.len() as u64 / u64::from(count)) as usize];
        let leaf = Leaf::sprouting(twig, skeleton, length_m, &noise, &mut rng);
        if is_folded { leaf.add_folded(builder) } else { leaf.add_rhomb(builder) }
    }
}

/// A leaf's axes, and its colour.
struct Leaf {
    base: Vec3,
    along: Vec3,
    across: Vec3,
    up: Vec3,
    /// Direction to the outside of the crown. It bends the normals a little, which makes the crown appear full.
    outwards: Vec3,
    color_srgb: Vec3,
    sway: f32,
}

impl Leaf {
    fn sprouting(twig: &Branch, skeleton: &Skeleton, length_m: f32, noise: &Noise, rng: &mut Rng) -> Self {
        let t = lerp(0.25, 1.0, rng.unit().sqrt());
        let knot = twig.at(t);
        let from_centre = (knot.position - skeleton.crown_centre) / skeleton.crown_radii;
        let outwards = from_centre.normalize_or(Vec3::Y);
        let heading = twig.direction_at(t) * 0.55 + rng.vector() * 0.8 + outwards * 0.35 - Vec3::Y * 0.12;
        let along = heading.normalize_or(Vec3::X);
        let facing = Vec3::Y * 0.75 + outwards * 0.55 + rng.vector() * 0.55;
        let up = (facing - along * facing.dot(along)).normalize_or(along.any_orthonormal_vector());
        let length_m = length_m * rng.between(0.72, 1.25);
        let exposure = from_centre.length().clamp(0.0, 1.0);
        Self {
            base: knot.position,
            along: along * length_m,
            across: along.cross(up) * (0.5 * WIDTH_OF_LENGTH * length_m),
            up,
            outwards,
            color_srgb: color_srgb(exposure, noise.in_space(knot.position * 6.0), rng),
            sway: knot.sway,
        }
    }

    /// A point at `t` along the leaf and `s` across. Both sides are raised as in an open book, and the tip hangs.
    fn vertex(&self, t: f32, s: f32, normal: Vec3, shade: f32) -> Vertex {
        let length_m = self.along.length();
        let lift = self.up * length_m * (0.16 * s.abs() - 0.22 * t * t);
        let position = self.base + self.along * t + self.across * s + lift;
        let normal = (normal * 0.75 + self.outwards * 0.25).normalize_or(self.up);
        let sway = (self.sway + LEAF_SWAY * t).min(1.0);
        Vertex { sway, uv: [0.5 + 0.5 * s, 1.0 - t], ..vertex(position, normal, self.color_srgb * shade) }
    }

    fn add_folded(&self, builder: &mut MeshBuilder) {
        let width_axis = self.across.normalize_or(Vec3::X);
        let mut push = |t: f32, s: f32, shade: f32| {
            let normal = (self.up - width_axis * (0.35 * s)).normalize_or(self.up);
            builder.push(self.vertex(t, s, normal, shade))
        };
        let base = push(0.0, 0.0, 0.95);
        let middle = push(0.5, 0.0, 1.1);
        let tip = push(1.0, 0.0, 1.05);
        let right = [push(0.28, 0.9, 0.97), push(0.62, 0.78, 1.0)];
        let left = [push(0.28, -0.9, 0.97), push(0.62, -0.78, 1.0)];
        // `across` is `along × up`, to the right as seen from above with the tip ahead.
        builder.indices.extend([base, right[0], middle, right[0], right[1], middle, right[1], tip, middle]);
        builder.indices.extend([base, middle, left[0], left[0], middle, left[1], left[1], middle, tip]);
    }

    fn add_rhomb(&self, builder: &mut MeshBuilder) {
        let mut push = |t: f32, s: f32, shade: f32| builder.push(self.vertex(t, s, self.up, shade));
        let corners = [push(0.0, 0.0, 0.95), push(0.45, 1.0, 1.0), push(1.0, 0.0, 1.05), push(0.45, -1.0, 1.0)];
        builder.quad(corners);
    }
}

/// Darker inside the crown, where less light comes; patches of yellower green; a rare turned leaf.
fn color_srgb(exposure: f32, patch: f32, rng: &mut Rng) -> Vec3 {
    let warmth = (0.4 + 0.5 * patch + rng.between(-0.3, 0.3)).clamp(0.0, 1.0);
    let cool = mix(Vec3::new(38.0, 70.0, 26.0), Vec3::new(70.0, 116.0, 40.0), exposure);
    let warm = mix(Vec3::new(62.0, 80.0, 24.0), Vec3::new(136.0, 152.0, 50.0), exposure);
    let green = mix(cool, warm, warmth);
    let turned = Vec3::new(190.0, 150.0, 58.0);
    let leaf = if rng.unit() < 0.012 { turned } else { green };
    leaf * lerp(0.62, 1.0, exposure * exposure) * rng.between(0.9, 1.1)
}
