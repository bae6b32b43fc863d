//! Pinhole images of what a mirror shows.

use depth_image::{Aabb, Camera, PinholeCamera};
use glam::{UVec2, Vec3};

use super::groups::Group;

/// The side of an image. Sessions scale all images of a mirror together.
pub(super) const SIDE_PX: u32 = 256;
/// A mirror whose normals have a mean of this length is flat.
const FLAT: f32 = 0.9;
/// How far images lie from the middle of a flat mirror, in half widths.
const ASIDE_OF_FLAT: f32 = 0.5;
/// How far images lie from the middle of any other mirror, in half widths.
pub(super) const ASIDE: f32 = 0.6;
/// The field of view of a face of the cube around a mirror's middle: neighbours overlap.
const FACE_DEG: f32 = 94.0;
/// The field of view of images of what lies before a mirror.
const WIDE_DEG: f32 = 110.0;

/// A number of images, from within a mirror or, of a flat one, from its plane. One alone stands in its middle.
pub(super) fn around(group: &Group, scene_bounds: &Aabb, images: u32) -> Vec<Camera> {
    let facing = group.area_normal_m2 / (group.area_m2 as f32).max(f32::MIN_POSITIVE);
    let is_flat = facing.length() > FLAT;
    let near_m = scene_bounds.near_m();
    let all = if is_flat { of_flat(group, facing, near_m) } else { of_round(group, scene_bounds.center(), near_m) };
    all.into_iter().skip(usize::from(images > 1)).take(images as usize).map(Camera::Pinhole).collect()
}

/// From the middle and from four places around it off the mirror, then from the middle along it.
fn of_flat(group: &Group, facing: Vec3, near_m: f32) -> Vec<PinholeCamera> {
    let middle = group.bounds.center();
    let half = 0.5 * group.bounds.size();
    let facing = facing.normalize_or(Vec3::Y);
    let right = facing.any_orthonormal_vector();
    // From the middle to the border of the mirror, which lies in its own plane however it is turned.
    let [right, up] = [right, facing.cross(right)].map(|axis| axis * half.dot(axis.abs()));
    let corners = [(-1.0, -1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0)];
    let aside = corners.map(|(x, y)| middle + (right * x + up * y) * ASIDE_OF_FLAT);
    let off = std::iter::once(middle).chain(aside).map(|eye| looking(eye, facing, WIDE_DEG, near_m));
    let along = [right, -right, up, -up].map(|along| along.normalize_or(facing));
    let along = along.map(|along| looking(middle, along, FACE_DEG, near_m));
    off.chain(along).collect()
}

/// Towards the middle of the scene from the mirror's middle and from two opposite sides, then from the middle in all directions: what
/// one of two sees past an edge, the other sees as well, so that the edge lies where it is.
fn of_round(group: &Group, middle_of_scene: Vec3, near_m: f32) -> Vec<PinholeCamera> {
    let middle = group.bounds.center();
    let towards = (middle_of_scene - middle).normalize_or(Vec3::Z);
    let right = towards.any_orthonormal_vector();
    let aside = (right + right.cross(towards)) * (ASIDE * 0.5 * group.bounds.size().min_element());
    let before = [middle, middle - aside, middle + aside].map(|eye| looking(eye, towards, WIDE_DEG, near_m));
    let faces = directions(towards).map(|axis| looking(middle, axis, FACE_DEG, near_m));
    before.into_iter().chain(faces).collect()
}

/// All directions, first those away from what lies before a mirror, and last the sky.
fn directions(before: Vec3) -> [Vec3; 6] {
    let mut level = [Vec3::NEG_Y, Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z];
    level.sort_by(|a, b| a.dot(before).total_cmp(&b.dot(before)));
    let [first, second, third, fourth, fifth] = level;
    [first, second, third, fourth, fifth, Vec3::Y]
}

/// Nothing nearer than `near_m` is seen.
fn looking(eye: Vec3, towards: Vec3, fov_deg: f32, near_m: f32) -> PinholeCamera {
    let up = if towards.y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y };
    let camera = PinholeCamera::looking_at(eye, eye + towards, up, fov_deg.to_radians(), UVec2::splat(SIDE_PX));
    PinholeCamera { near_m, ..camera }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_faces_see_every_direction() {
        let eye = Vec3::new(1.0, 2.0, 3.0);
        let cameras = directions(Vec3::Z).map(|axis| looking(eye, axis, FACE_DEG, 0.01));
        let directions = (0..500).map(|i| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let (sin, cos) = f32::sin_cos(i as f32 * 2.4);
            Vec3::new(sin, 0.0, cos) * (1.0 - y * y).sqrt() + Vec3::Y * y
        });
        for direction in directions {
            let point = eye + direction * 5.0;
            let sees = |camera: &PinholeCamera| camera.project(point).is_some_and(|at| camera.contains(at.pixel));
            assert!(cameras.iter().any(sees), "{direction}");
        }
    }
}
