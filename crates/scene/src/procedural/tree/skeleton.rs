//! The branches of a tree.

use depth_image::Aabb;
use glam::{Quat, Vec3};

use super::super::parts::{Rng, lerp};

/// Trunk, limbs, branches, shoots, twigs.
pub(super) const LEVELS: usize = 5;

const GOLDEN_ANGLE_RAD: f32 = 2.399_963;

// Growth of the branches of each level.
/// Knots along a branch.
const KNOTS: [u32; LEVELS] = [14, 11, 7, 5, 3];
const CHILDREN: [u32; LEVELS] = [17, 11, 7, 4, 0];
/// Place of the first child along the branch.
const FIRST_CHILD: [f32; LEVELS] = [0.27, 0.18, 0.15, 0.2, 1.0];
/// Change of direction a knot, at random.
const WANDER: [f32; LEVELS] = [0.07, 0.13, 0.16, 0.2, 0.2];
/// Change of direction a knot, upwards.
const RISE: [f32; LEVELS] = [0.05, 0.045, 0.03, 0.02, -0.02];
/// Length as a share of the parent's.
const LENGTH: [f32; LEVELS] = [1.0, 0.74, 0.50, 0.46, 0.55];
/// Angle to the parent at its foot and at its tip.
const ANGLES_RAD: [[f32; 2]; LEVELS] = [[0.0; 2], [1.22, 0.55], [1.0, 0.6], [0.95, 0.6], [0.9, 0.5]];
/// Additional sway of the tip over the foot.
const SWAY: [f32; LEVELS] = [0.10, 0.22, 0.22, 0.16, 0.10];

/// A point on a branch's axis.
#[derive(Clone, Copy)]
pub(super) struct Knot {
    pub position: Vec3,
    pub radius_m: f32,
    pub sway: f32,
}

pub(super) struct Branch {
    pub level: usize,
    pub knots: Vec<Knot>,
}

pub(super) struct Skeleton {
    pub branches: Vec<Branch>,
    /// Middle and half extents of the crown.
    pub crown_centre: Vec3,
    pub crown_radii: Vec3,
}

impl Skeleton {
    /// Grows a tree about one unit high, with its foot at the origin.
    pub(super) fn grown(seed: u64) -> Self {
        let mut rng = Rng::new(seed, 1);
        let foot = Knot { position: Vec3::ZERO, radius_m: 0.034, sway: 0.0 };
        let trunk = grow(0, foot, Vec3::Y, 0.78, &mut rng);
        let mut branches = vec![trunk];
        let mut next = 0;
        while next < branches.len() {
            let children = children_of(&branches[next], &mut rng);
            branches.extend(children);
            next += 1;
        }
        Self { branches, crown_centre: Vec3::ZERO, crown_radii: Vec3::ONE }
    }

    /// Scales the tree to `height_m`, moves it to `foot`, and measures the crown.
    pub(super) fn fitted(mut self, foot: Vec3, height_m: f32) -> Self {
        /// Room for the leaves at the very top, and for the crown within the block.
        const LEAF_MARGIN_M: f32 = 0.02;
        const MAX_REACH_M: f32 = 0.62;
        let mut top = 1e-3f32;
        let mut reach = 1e-3f32;
        for knot in self.branches.iter().flat_map(|b| &b.knots) {
            top = top.max(knot.position.y);
            reach = reach.max(knot.position.x.hypot(knot.position.z));
        }
        let scale = ((height_m - LEAF_MARGIN_M) / top).min(MAX_REACH_M / reach);
        for knot in self.branches.iter_mut().flat_map(|b| &mut b.knots) {
            knot.position = foot + knot.position * scale;
            knot.radius_m *= scale;
        }
        let twigs = self.branches.iter().filter(|b| b.level + 1 == LEVELS).flat_map(|b| &b.knots);
        let crown = Aabb::around(twigs.map(|knot| knot.position));
        if crown.min.is_finite() {
            self.crown_centre = crown.center();
            self.crown_radii = (crown.size() * 0.5).max(Vec3::splat(1e-3));
        }
        self
    }
}

impl Branch {
    /// At `t` from 0 (foot) to 1 (tip): a Catmull-Rom curve through the knots.
    pub(super) fn at(&self, t: f32) -> Knot {
        let last = self.knots.len() - 1;
        let along = t.clamp(0.0, 1.0) * last as f32;
        let i = (along as usize).min(last - 1);
        let f = along - i as f32;
        let around = [i.saturating_sub(1), i, i + 1, (i + 2).min(last)].map(|k| self.knots[k]);
        let [_, before, after, _] = around;
        let [p0, p1, p2, p3] = around.map(|knot| knot.position);
        let curve = p1 * 2.0
            + (p2 - p0) * f
            + (p0 * 2.0 - p1 * 5.0 + p2 * 4.0 - p3) * (f * f)
            + (p1 * 3.0 - p0 - p2 * 3.0 + p3) * (f * f * f);
        Knot {
            position: curve * 0.5,
            radius_m: lerp(before.radius_m, after.radius_m, f),
            sway: lerp(before.sway, after.sway, f),
        }
    }

    pub(super) fn direction_at(&self, t: f32) -> Vec3 {
        (self.at(t + 0.05).position - self.at(t - 0.05).position).normalize_or(Vec3::Y)
    }
}

fn grow(level: usize, foot: Knot, direction: Vec3, length: f32, rng: &mut Rng) -> Branch {
    let step = length / KNOTS[level] as f32;
    let mut knots = vec![foot];
    let mut position = foot.position;
    let mut direction = direction;
    for i in 1..=KNOTS[level] {
        let t = i as f32 / KNOTS[level] as f32;
        // Limbs sag in the middle under their weight and lift their ends to the light.
        let lift = RISE[level] * lerp(-0.6, 2.2, t);
        direction = (direction + rng.vector() * WANDER[level] + Vec3::Y * lift).normalize_or(Vec3::Y);
        position += direction * step * rng.between(0.9, 1.1);
        // Branches stay above the ground.
        position.y = position.y.max(0.04);
        let taper = if level == 0 { lerp(1.0, 0.12, t.powf(0.9)) } else { lerp(1.0, 0.22, t) };
        knots.push(Knot { position, radius_m: foot.radius_m * taper, sway: foot.sway + SWAY[level] * t.powf(1.3) });
    }
    Branch { level, knots }
}

fn children_of(parent: &Branch, rng: &mut Rng) -> Vec<Branch> {
    let level = parent.level + 1;
    let children = CHILDREN[parent.level];
    if children == 0 {
        return Vec::new();
    }
    let parent_length = parent.knots.windows(2).map(|w| w[0].position.distance(w[1].position)).sum::<f32>();
    let first_turn = rng.between(0.0, std::f32::consts::TAU);
    let branches = (0..children).map(|i| {
        let u = (i as f32 + rng.between(0.1, 0.9)) / children as f32;
        let t = lerp(FIRST_CHILD[parent.level], 0.98, u);
        let turn = first_turn + GOLDEN_ANGLE_RAD * i as f32 + rng.between(-0.35, 0.35);
        let knot = parent.at(t);
        let angle = lerp(ANGLES_RAD[level][0], ANGLES_RAD[level][1], u) + rng.between(-0.18, 0.18);
        let direction = tilted(parent.direction_at(t), angle, turn);
        let length = parent_length * LENGTH[level] * envelope(level, u) * rng.between(0.8, 1.2);
        let thickness = if level == 1 { 0.52 } else { 0.6 };
        let radius_m = (knot.radius_m * thickness).min(0.05 * length).max(4e-4);
        grow(level, Knot { radius_m, ..knot }, direction, length, rng)
    });
    branches.collect()
}

/// Limbs are longest a third up the crown, which makes it a dome; others shorten towards the tip.
fn envelope(level: usize, u: f32) -> f32 {
    match level {
        1 if u < 0.3 => lerp(0.82, 1.0, u / 0.3),
        1 => 1.0 - 0.62 * ((u - 0.3) / 0.7).powi(2),
        _ => lerp(1.0, 0.5, u),
    }
}

/// `axis` turned away by `angle_rad`, towards the side that `turn_rad` names.
fn tilted(axis: Vec3, angle_rad: f32, turn_rad: f32) -> Vec3 {
    let side = axis.any_orthonormal_vector();
    let side = Quat::from_axis_angle(axis, turn_rad) * side;
    (Quat::from_axis_angle(side, angle_rad) * axis).normalize_or(axis)
}
