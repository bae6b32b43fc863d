//! Single-pole images of the object that a mirror shows most.

use depth_image::{Aabb, Camera, SinglePoleCamera};
use glam::{UVec2, Vec3};

use super::directions::{ASIDE, SIDE_PX};
use super::groups::{Group, Surface, groups};
use super::rays::PLACES;
use super::seen::{Images, Ways, seen_by, sees, strike};

/// The distortions that are tried, in half sides of an image.
const DISTORTIONS: [f32; 6] = [0.0, 0.1, 0.2, 0.3, 0.45, 0.6];
/// What rises less above the scene's lowest point, in heights of the scene, is no object but the ground.
const GROUND: f32 = 0.01;
/// An object's box is larger than what rays meet of it, in diagonals: few of them meet its edges.
const MARGIN: f32 = 0.02;
/// All of an object lies at this share of the depth of its middle at least: nothing of it is beside an eye on the mirror.
const LEAST_DEPTH: f32 = 0.2;

/// One image from the mirror's middle, and two from both sides of it; none where rays meet no object.
pub(super) fn candidates(group: &Group, ways: &Ways<'_>) -> Vec<Images> {
    let middle = group.bounds.center();
    let Some(bounds) = object(middle, ways) else { return Vec::new() };
    let towards = (bounds.center() - middle).normalize_or(Vec3::Z);
    let right = towards.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
    let aside = right * (ASIDE * 0.5 * group.bounds.size().min_element());
    let met: Vec<Vec3> = ends(ways).filter(|end| bounds.grown_to(*end) == bounds).collect();
    let images = |eyes: &[Vec3]| {
        let cameras = around(&bounds, eyes, &met, ways);
        let mut unseen = vec![true; ways.deciding.len() * PLACES];
        cameras.iter().for_each(|camera| strike(&mut unseen, &seen_by(camera, &ways.deciding, ways.triangles)));
        Images { cameras, unseen }
    };
    vec![images(&[middle]), images(&[middle - aside, middle + aside])]
}

/// Where rays meet what is no ground.
fn ends<'w>(ways: &'w Ways<'_>) -> impl Iterator<Item = Vec3> + 'w {
    let volume = ways.triangles.volume;
    let ground_y = volume.min.y + GROUND * volume.size().y;
    let met = ways.deciding.iter().filter(|way| way.ends_at_surface).filter_map(|way| way.places().last());
    met.filter(move |end| end.y > ground_y)
}

/// The box of what the most rays meet together, of all that lies before the mirror's middle.
fn object(middle: Vec3, ways: &Ways<'_>) -> Option<Aabb> {
    let each = |each: &mut dyn FnMut(Surface)| ends(ways).for_each(|end| each(Surface::Triangle([end; 3], false)));
    let (objects, _) = groups(&ways.triangles.volume, usize::MAX, each);
    let lies_before = |bounds: &Aabb| {
        let axis = bounds.center() - middle;
        bounds.corners().iter().all(|corner| (corner - middle).dot(axis) > LEAST_DEPTH * axis.length_squared())
    };
    let padded = |group: Group| group.bounds.padded(MARGIN * group.bounds.size().length());
    let before = objects.into_iter().map(padded).filter(lies_before);
    before.max_by_key(|bounds| ends(ways).filter(|end| bounds.grown_to(*end) == *bounds).count())
}

/// Cameras at these eyes, of the distortion at which one of them sees the most of `met`.
fn around(bounds: &Aabb, eyes: &[Vec3], met: &[Vec3], ways: &Ways<'_>) -> Vec<Camera> {
    let cameras = |distortion: f32| -> Vec<Camera> {
        let at = |eye: &Vec3| {
            SinglePoleCamera::around(bounds, *eye, distortion * 0.5 * SIDE_PX, UVec2::splat(SIDE_PX as u32))
        };
        eyes.iter().map(at).map(Camera::SinglePole).collect()
    };
    let is_seen = |cameras: &[Camera], end: Vec3| cameras.iter().any(|camera| sees(camera, end, ways.triangles));
    let seen = |cameras: &Vec<Camera>| met.iter().filter(|end| is_seen(cameras, **end)).count();
    // Of equals the least distorted.
    DISTORTIONS.into_iter().rev().map(cameras).max_by_key(seen).unwrap_or_default()
}
