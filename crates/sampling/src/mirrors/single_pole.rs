//! Single-pole images of the object that a mirror shows most.

use depth_image::{Aabb, Camera, SinglePoleCamera};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

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
/// A place is shown well where the pixels beside it differ in depth by as many footprints, or fewer.
const WELL_SHOWN_FOOTPRINTS: f32 = 2.0;
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

/// Whether a camera sees a place of a surface, and the pixels beside it see the surface go on: at grazing angles few samples show
/// much of it.
fn shows(camera: &SinglePoleCamera, place: Vec3, ways: &Ways<'_>) -> bool {
    let Some(at) = camera.project(place) else { return false };
    let tolerance_m = WELL_SHOWN_FOOTPRINTS * at.planar_depth_m / camera.reference.focal_px.min_element();
    let goes_on = |offset_px: Vec2| {
        let ray = camera.ray(at.pixel + offset_px);
        let from = ray.at(camera.reference.near_m);
        let met = ways.triangles.first_met(from, ray.direction_in_world);
        met.is_some_and(|t| (camera.reference.near_m + t - at.planar_depth_m).abs() <= tolerance_m)
    };
    sees(&Camera::SinglePole(*camera), place, ways.triangles)
        && [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y].into_iter().all(goes_on)
}

/// Cameras at these eyes, of the distortion at which one of them shows the most of `met`.
fn around(bounds: &Aabb, eyes: &[Vec3], met: &[Vec3], ways: &Ways<'_>) -> Vec<Camera> {
    let cameras = |distortion: f32| -> Vec<SinglePoleCamera> {
        let at = |eye: &Vec3| {
            SinglePoleCamera::around(bounds, *eye, distortion * 0.5 * SIDE_PX, UVec2::splat(SIDE_PX as u32))
        };
        eyes.iter().map(at).collect()
    };
    let shown = |cameras: &Vec<SinglePoleCamera>| {
        let is_shown = |end: &&Vec3| cameras.iter().any(|camera| shows(camera, **end, ways));
        met.par_iter().filter(is_shown).count()
    };
    // Of equals the least distorted.
    let best = DISTORTIONS.into_iter().rev().map(cameras).max_by_key(shown).unwrap_or_default();
    best.into_iter().map(Camera::SinglePole).collect()
}

#[cfg(test)]
mod tests {
    use fixtures::teapot_mirror;

    use super::*;
    use crate::mirrors::rays::Triangles;

    /// What most of the teapot's own points see of it.
    #[test]
    fn distortion_shows_more_of_an_object_than_a_pinhole() {
        let scene = teapot_mirror();
        let triangles = Triangles::of(&scene, scene.bounds()).expect("a tree");
        let ways = Ways { triangles: &triangles, deciding: Vec::new(), fresh: Vec::new() };
        let bounds = Aabb { min: Vec3::new(-3.2, 0.0, 0.5), max: Vec3::new(3.2, 3.2, 4.5) };
        let eye = Vec3::new(0.0, 3.1, -4.5);
        // On the teapot, as it is seen from all around.
        let around = (0..4000).filter_map(|number| {
            let height = 1.0 - 1.9 * (number as f32 + 0.5) / 4000.0;
            let (sin, cos) = (number as f32 * 2.399_963).sin_cos();
            let side = (1.0 - height * height).max(0.0).sqrt();
            let from = bounds.center() + Vec3::new(side * sin, 0.6 * height + 0.4, side * cos) * 12.0;
            let towards = (bounds.center() - from).normalize_or(Vec3::Z);
            Some(from + towards * triangles.first_met(from, towards)?)
        });
        let places: Vec<Vec3> = around.filter(|place| place.z < 3.0 && place.y > 0.1).collect();
        let shown = |distortion: f32| {
            let half_px = 0.5 * SIDE_PX;
            let camera = SinglePoleCamera::around(&bounds, eye, distortion * half_px, UVec2::splat(SIDE_PX as u32));
            places.iter().filter(|place| shows(&camera, **place, &ways)).count() as f32 / places.len() as f32
        };
        let [pinhole, bent] = [0.0, 0.45].map(shown);
        println!("{} places: {pinhole} are shown by a pinhole, {bent} by a single pole", places.len());
        assert!(places.len() > 1000 && bent > pinhole + 0.05, "{pinhole}, {bent}");
    }
}
