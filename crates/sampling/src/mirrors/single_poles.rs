//! Single-pole images of the object that a mirror shows largest (Rosen et al., section 4).

use depth_image::{Aabb, Camera, SinglePoleCamera};
use glam::{UVec2, Vec3};
use scene::Scene;

use super::groups::{Group, Surface, groups, surfaces};
use super::pinholes::{ASIDE, SIDE_PX};

/// The distortion of an image, in half sides: about the one at which most mirrored rays find the teapot (docs/methods/single_pole.md).
const DISTORTION: f32 = 0.45;
/// What rises less above the scene's lowest point, in heights of the scene, is no object but the ground.
const GROUND: f32 = 0.01;
/// All of an object lies at this share of the depth of its middle at least: nothing of it is beside an eye on the mirror.
const LEAST_DEPTH: f32 = 0.2;

/// The boxes of all that is neither ground nor mirror.
pub(super) fn objects(scene: &Scene, is_mirror: &[bool], bounds_of_instances: &[Aabb]) -> Vec<Aabb> {
    let volume = Aabb::of_boxes(bounds_of_instances);
    let ground_y = volume.min.y + GROUND * volume.size().y;
    let is_matt: Vec<bool> = is_mirror.iter().map(|is| !is).collect();
    let mut surfaces = surfaces(scene, &is_matt, bounds_of_instances);
    surfaces.retain(|surface: &Surface| surface.bounds().max.y > ground_y);
    groups(&volume, &surfaces).iter().map(|object| object.bounds).collect()
}

/// One image from a mirror's middle, or two from both sides of it. `None` where no object lies before the mirror.
pub(super) fn around(group: &Group, objects: &[Aabb], images: u32) -> Option<Vec<Camera>> {
    let middle = group.bounds.center();
    let before = objects.iter().filter(|object| {
        let axis = object.center() - middle;
        object.corners().iter().all(|corner| (corner - middle).dot(axis) > LEAST_DEPTH * axis.length_squared())
    });
    let object = before.max_by(|a, b| apparent_size(a, middle).total_cmp(&apparent_size(b, middle)))?;
    let towards = (object.center() - middle).normalize_or(Vec3::Z);
    let right = towards.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
    let aside = right * (ASIDE * 0.5 * group.bounds.size().min_element());
    let eyes = if images == 1 { vec![middle] } else { vec![middle - aside, middle + aside] };
    let distortion_px = DISTORTION * 0.5 * SIDE_PX as f32;
    let cameras = eyes.iter().map(|&eye| SinglePoleCamera::around(object, eye, distortion_px, UVec2::splat(SIDE_PX)));
    Some(cameras.map(Camera::SinglePole).collect())
}

fn apparent_size(object: &Aabb, eye: Vec3) -> f32 {
    object.size().length_squared() / object.center().distance_squared(eye)
}
