//! Two mirror balls in a hall.

use glam::Vec3;

use super::parts::{MeshBuilder, Teapot, ball, checked, checks, matt, mirror, teapot};
use crate::Scene;

const HALL_HALF_SIDE_M: u32 = 4;
const HALL_HEIGHT_M: u32 = 4;

/// Two mirror balls of radius 1.5 m and a teapot of half its size in a hall of 8 × 4 × 8 m with checks of 1 m, open to the sky.
#[must_use]
pub fn mirror_hall() -> Scene {
    let mut builder = MeshBuilder::default();
    checks(&mut builder, HALL_HALF_SIDE_M);
    let half_side_m = HALL_HALF_SIDE_M as f32;
    for inwards in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        let right = Vec3::Y.cross(inwards);
        let corner = -half_side_m * (inwards + right);
        checked(&mut builder, corner, [right, Vec3::Y], [2 * HALL_HALF_SIDE_M, HALL_HEIGHT_M]);
    }
    teapot(&mut builder, Teapot { foot: Vec3::new(0.0, 0.0, 0.8), scale: 0.5, squares: 16 });
    builder.finish_part(0);
    for side in [-1.0, 1.0] {
        ball(&mut builder, Vec3::new(2.0 * side, 1.5, -1.8), 1.5, Vec3::splat(255.0));
    }
    builder.finish_part(1);
    builder.into_scene_of("mirror-hall", vec![matt("matt"), mirror(0.8)]).with_default_background()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hall_has_the_triangles_that_it_promises() {
        let scene = mirror_hall();
        let triangles: Vec<u32> = scene.meshes[0].parts.iter().map(|part| part.index_count / 3).collect();
        assert_eq!(triangles, [2 * 8 * (8 + 4 * 4) + 16_384, 2 * 2 * 64 * 31]);
    }

    /// Every wall's front is towards the middle of the hall.
    #[test]
    fn the_hall_is_seen_from_within() {
        let mesh = &mirror_hall().meshes[0];
        let walls = mesh.indices.as_chunks::<3>().0.iter().take(2 * 8 * (8 + 4 * 4));
        for corners in walls {
            let [a, b, c] = corners.map(|corner| Vec3::from(mesh.vertices[corner as usize].position));
            assert!((b - a).cross(c - a).dot(Vec3::Y * 2.0 - a) > 0.0, "{a}");
        }
    }
}
