//! Four blocks, one of which two views cannot show: figure 3 of Xie, Wang and Popescu's *Non-redundant rendering*.

use glam::{Vec2, Vec3};

use super::geometry::{MeshBuilder, matt};
use crate::Scene;

/// World metres for a unit of [`LAYOUT`].
const SCALE_M: f32 = 4.0;
/// How far ahead of the viewpoints the world's origin lies, in units of [`LAYOUT`].
const ORIGIN_AHEAD: f32 = 4.0;
/// All blocks stand this far below the viewpoints, in the same units.
const FOOT: f32 = -0.5;

/// A block's extent to the right and ahead of V0, and its top above the viewpoints. The unit is the distance from V0 to
/// V1 on its right.
struct Block {
    right: [f32; 2],
    ahead: [f32; 2],
    top: f32,
    color_srgb: Vec3,
}

/// The blocks A, B, C and D, in this order. A stands before V0 and D before V1, with a gap between. A hides B from V0,
/// and the gap shows B to V1. B hides C from V0 and D hides C from V1; the gap shows C to a viewpoint in the middle. A
/// reaches to the left of V0 and D to the right of V1, so that each viewpoint sees only the front of the block before
/// it.
const LAYOUT: [Block; 4] = [
    block([-0.5, 0.3], [2.0, 2.5], 0.6, [206, 84, 62]),
    block([-0.1, 0.45], [4.0, 4.4], 0.5, [88, 150, 86]),
    block([0.46, 0.64], [6.0, 6.4], 0.45, [222, 186, 74]),
    block([0.75, 1.4], [2.0, 2.4], 0.6, [74, 116, 186]),
];

const fn block(right: [f32; 2], ahead: [f32; 2], top: f32, [r, g, b]: [u8; 3]) -> Block {
    Block { right, ahead, top, color_srgb: Vec3::new(r as f32, g as f32, b as f32) }
}

/// The viewpoints of [`blocks`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlocksViewpoints {
    /// V0 and V1. V0 sees A and D; V1 also sees B. Only the middle between them sees C.
    pub eyes_in_world: [Vec3; 2],
    /// The cameras' target.
    pub target_in_world: Vec3,
}

/// The two viewpoints of [`blocks`].
#[must_use]
pub fn blocks_viewpoints() -> BlocksViewpoints {
    BlocksViewpoints {
        eyes_in_world: [0.0, 1.0].map(|right| in_world(Vec2::new(right, 0.0), 0.0)),
        target_in_world: in_world(Vec2::new(0.5, ORIGIN_AHEAD), 0.0),
    }
}

/// Blocks A (red), B (green), C (yellow) and D (blue), 12 triangles each, for [`blocks_viewpoints`].
#[must_use]
pub fn blocks() -> Scene {
    let mut builder = MeshBuilder::default();
    for block in &LAYOUT {
        let [min, max] = block.corners_in_world();
        builder.cuboid(min, max, block.color_srgb);
    }
    builder.into_scene("blocks", matt("blocks"))
}

impl Block {
    /// Least and greatest corner.
    fn corners_in_world(&self) -> [Vec3; 2] {
        let [left, right] = self.right;
        let [near, far] = self.ahead;
        [in_world(Vec2::new(left, far), FOOT), in_world(Vec2::new(right, near), self.top)]
    }
}

/// Maps plan coordinates (to the right, ahead) and a height above the viewpoints to world space: ahead is -z.
fn in_world(plan: Vec2, height: f32) -> Vec3 {
    Vec3::new(plan.x - 0.5, height, ORIGIN_AHEAD - plan.y) * SCALE_M
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: usize = 0;
    const B: usize = 1;
    const C: usize = 2;
    const D: usize = 3;

    /// The entry of the way from `eye` to `target` into a box, if it lies well before the target.
    fn entry(eye: Vec3, target: Vec3, block: usize) -> Option<Vec3> {
        let [min, max] = LAYOUT[block].corners_in_world();
        let along = target - eye;
        let (to_min, to_max) = ((min - eye) / along, (max - eye) / along);
        let (enters, leaves) = (to_min.min(to_max).max_element(), to_min.max(to_max).min_element());
        (enters < leaves && enters > 0.0 && enters < 1.0 - 1e-4).then(|| eye + along * enters)
    }

    fn in_front_of(eye: Vec3, target: Vec3) -> Vec<usize> {
        (0..4).filter(|&block| entry(eye, target, block).is_some()).collect()
    }

    /// Points on the face towards the viewpoints, without its rim.
    fn front(block: usize) -> Vec<Vec3> {
        let [min, max] = LAYOUT[block].corners_in_world();
        let steps = || (0..=20).map(|i| 0.005 + 0.99 * i as f32 / 20.0);
        steps()
            .flat_map(|s| {
                steps().map(move |t| Vec3::new(min.x + s * (max.x - min.x), min.y + t * (max.y - min.y), max.z))
            })
            .collect()
    }

    fn is_front_seen(eye: Vec3, block: usize) -> bool {
        front(block).iter().all(|&point| in_front_of(eye, point).is_empty())
    }

    /// Points on all six faces.
    fn surface(block: usize) -> Vec<Vec3> {
        let [min, max] = LAYOUT[block].corners_in_world();
        let steps: Vec<Vec3> = (0..9 * 9 * 9u16)
            .map(|i| Vec3::new((i % 9).into(), (i / 9 % 9).into(), (i / 81).into()) / 8.0)
            .filter(|s| s.min_element() == 0.0 || s.max_element() == 1.0)
            .collect();
        steps.into_iter().map(|s| min + s * (max - min)).collect()
    }

    fn is_hidden(eye: Vec3, block: usize) -> bool {
        surface(block).iter().all(|&point| in_front_of(eye, point).iter().any(|&other| other != block))
    }

    #[test]
    fn v0_sees_the_fronts_of_a_and_d_and_nothing_of_b_and_c() {
        let [v0, _] = blocks_viewpoints().eyes_in_world;
        assert!(is_front_seen(v0, A) && is_front_seen(v0, D));
        assert!(is_hidden(v0, B) && is_hidden(v0, C));
    }

    #[test]
    fn v1_sees_the_fronts_of_b_and_d_but_nothing_of_c() {
        let [_, v1] = blocks_viewpoints().eyes_in_world;
        assert!(is_front_seen(v1, B) && is_front_seen(v1, D));
        assert!(is_hidden(v1, C));
    }

    #[test]
    fn the_middle_between_them_sees_the_front_of_c() {
        let [v0, v1] = blocks_viewpoints().eyes_in_world;
        assert!(is_front_seen(v0.midpoint(v1), C));
    }

    /// Two layers of depth peeling from V0 therefore miss C.
    #[test]
    fn c_is_doubly_hidden_from_v0_by_a_and_b() {
        let [v0, _] = blocks_viewpoints().eyes_in_world;
        assert!(front(C).iter().all(|&point| in_front_of(v0, point) == [A, B]));
    }

    /// V1's image omits the surfaces that V0 has seen; then no surface is left before C.
    #[test]
    fn v0_sees_every_surface_that_hides_c_from_v1() {
        let [v0, v1] = blocks_viewpoints().eyes_in_world;
        let front_of_d_m = LAYOUT[D].corners_in_world()[1].z;
        for point in front(C) {
            assert_eq!(in_front_of(v1, point), [D]);
            let hidden_by = entry(v1, point, D).unwrap();
            assert!((hidden_by.z - front_of_d_m).abs() < 1e-3, "{hidden_by} is not on the front");
            assert!(in_front_of(v0, hidden_by).is_empty());
        }
    }

    /// A displaced box is detected, because the rays above find the boxes' places.
    #[test]
    fn the_scene_holds_the_boxes_in_order() {
        let scene = blocks();
        for (number, corners) in scene.meshes[0].vertices.chunks_exact(24).enumerate() {
            let [min, max] = LAYOUT[number].corners_in_world();
            let of = |pick: fn(Vec3, Vec3) -> Vec3| corners.iter().map(|v| Vec3::from(v.position)).reduce(pick);
            assert!(of(Vec3::min).unwrap().distance(min) < 1e-5, "block {number}");
            assert!(of(Vec3::max).unwrap().distance(max) < 1e-5, "block {number}");
        }
    }
}
