//! Images in given directions.

use depth_image::PinholeCamera;
use glam::{UVec2, Vec3};

/// The field of view of a face of the cube around a mirror's middle: neighbours overlap.
pub(super) const FACE_DEG: f32 = 94.0;
/// How far images lie from the middle of a mirror that is not flat, in half widths.
pub(super) const ASIDE: f32 = 0.6;
/// The side of the image that shows most ends of rays best; sizes are in proportion.
pub(super) const SIDE_PX: f32 = 256.0;
/// The field of view of further images.
pub(super) const WIDE_DEG: f32 = 110.0;

/// Six images in all directions from one place.
#[must_use]
pub fn faces(eye_in_world: Vec3, near_m: f32, size_px: UVec2) -> Vec<PinholeCamera> {
    let directions = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    directions.map(|towards| looking((eye_in_world, near_m), towards, FACE_DEG, size_px)).collect()
}

/// An image from an eye in a direction. Nothing nearer than `near_m` is seen.
#[must_use]
pub fn looking((eye, near_m): (Vec3, f32), towards: Vec3, fov_deg: f32, size_px: UVec2) -> PinholeCamera {
    let up = if towards.y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y };
    let camera = PinholeCamera::looking_at(eye, eye + towards, up, fov_deg.to_radians(), size_px);
    PinholeCamera { near_m, ..camera }
}
