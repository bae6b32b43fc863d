//! Tapered tubes around the branches.

use std::f32::consts::TAU;

use glam::Vec3;

use super::super::parts::{MeshBuilder, Noise, mix, vertex};
use super::skeleton::{Branch, LEVELS, Skeleton};
use crate::Vertex;

/// Rings along and sides around a branch of each level, at detail 1.
const RINGS: [f32; LEVELS] = [40.0, 18.0, 9.0, 5.0, 2.0];
const SIDES: [f32; LEVELS] = [28.0, 13.0, 8.0, 5.0, 4.0];

/// Detail of each level, and the share of its branches.
#[derive(Clone, Copy)]
struct Detail {
    rings: [u32; LEVELS],
    sides: [u32; LEVELS],
    share: [f32; LEVELS],
}

/// Adds the branches in at most `budget` triangles. A small budget omits most of the twigs, which the leaves hide.
pub(super) fn add(builder: &mut MeshBuilder, skeleton: &Skeleton, budget: u32, seed: u64) {
    let detail = Detail::within(budget, skeleton);
    let noise = Noise::new(seed ^ 0xba4c);
    let mut number_in_level = [0u32; LEVELS];
    for branch in &skeleton.branches {
        let number = &mut number_in_level[branch.level];
        // Every 1/share-th branch of the level, evenly over the tree.
        let before = (*number as f32 * detail.share[branch.level]) as u32;
        *number += 1;
        if (*number as f32 * detail.share[branch.level]) as u32 > before {
            add_tube(builder, branch, detail.rings[branch.level], detail.sides[branch.level], &noise);
        }
    }
}

impl Detail {
    fn at(scale: f32) -> Self {
        let rings = RINGS.map(|rings| (rings * scale).round().max(1.0) as u32);
        let sides = SIDES.map(|sides| (sides * scale).round().max(3.0) as u32);
        Self { rings, sides, share: [1.0; LEVELS] }
    }

    fn within(budget: u32, skeleton: &Skeleton) -> Self {
        let mut branches = [0u32; LEVELS];
        skeleton.branches.iter().for_each(|b| branches[b.level] += 1);
        let mut details = (0..40).map(|step| Self::at(4.0 * 0.92f32.powi(step)));
        let fitting = details.find(|detail| detail.triangles(&branches) <= budget as f32);
        fitting.unwrap_or_else(|| Self::at(0.2).thinned_to(budget as f32, &branches))
    }

    /// Drops twigs first, then shoots, and so on.
    fn thinned_to(mut self, budget: f32, branches: &[u32; LEVELS]) -> Self {
        for level in (0..LEVELS).rev() {
            let excess = self.triangles(branches) - budget;
            if excess > 0.0 {
                let own = self.triangles_of(level, branches);
                self.share[level] = ((own - excess) / own).max(0.0);
            }
        }
        self
    }

    fn triangles(&self, branches: &[u32; LEVELS]) -> f32 {
        (0..LEVELS).map(|level| self.triangles_of(level, branches)).sum()
    }

    fn triangles_of(&self, level: usize, branches: &[u32; LEVELS]) -> f32 {
        (2 * self.rings[level] * self.sides[level] * branches[level]) as f32 * self.share[level]
    }
}

fn add_tube(builder: &mut MeshBuilder, branch: &Branch, rings: u32, sides: u32, noise: &Noise) {
    let first = builder.vertices.len() as u32;
    let mut side = branch.direction_at(0.0).any_orthonormal_vector();
    for ring in 0..=rings {
        let t = ring as f32 / rings as f32;
        let along = branch.direction_at(t);
        // The frame is transported along the branch, so that the tube does not twist.
        side = (side - along * side.dot(along)).normalize_or(along.any_orthonormal_vector());
        for i in 0..sides {
            let angle = TAU * i as f32 / sides as f32;
            let outwards = side * angle.cos() + along.cross(side) * angle.sin();
            builder.push(bark_vertex(branch, t, outwards, angle, noise));
        }
    }
    builder.join_rings(first, rings + 1, sides, false);
}

fn bark_vertex(branch: &Branch, t: f32, outwards: Vec3, angle_rad: f32, noise: &Noise) -> Vertex {
    let knot = branch.at(t);
    let mut radius_m = knot.radius_m;
    let grain = noise.in_space(outwards * 2.5 + knot.position * Vec3::new(60.0, 14.0, 60.0));
    if branch.level == 0 {
        // Roots spread where the trunk meets the ground.
        let flare = (-t * 16.0).exp();
        radius_m *= 1.0 + flare * (0.9 + 0.45 * (5.0 * angle_rad).sin());
    }
    if branch.level < 2 {
        radius_m *= 1.0 + 0.09 * grain;
    }
    let thin = branch.level as f32 / LEVELS as f32;
    let dark = mix(Vec3::new(58.0, 46.0, 36.0), Vec3::new(84.0, 70.0, 50.0), thin);
    let light = mix(Vec3::new(122.0, 104.0, 84.0), Vec3::new(112.0, 98.0, 68.0), thin);
    let color = mix(dark, light, 0.45 + 0.55 * grain);
    Vertex { sway: knot.sway, ..vertex(knot.position + outwards * radius_m, outwards, color) }
}
