//! The places of a relief: a turn, a uniform scale and a translation each.

use depth_image::{Aabb, PinholeCamera, Ray};
use glam::{Affine3A, UVec2, Vec2, Vec3};
use rayon::prelude::*;

pub const MAX_PLACEMENTS: usize = 4096;
/// The side of a picture's tiles.
const TILE_PX: u32 = 8;
/// The greatest difference of a placement's axes from one length and right angles, in shares of its scale.
const RIGID: f32 = 1e-3;
/// The least and the greatest scale.
const SCALES: [f32; 2] = [1e-4, 1e4];

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlacementError {
    #[error("{placements} placements, at most {MAX_PLACEMENTS}")]
    TooMany { placements: usize },
    #[error("placement {placement} is not finite")]
    NotFinite { placement: usize },
    #[error("placement {placement} mirrors its object or has no volume: its determinant is {determinant}")]
    Mirroring { placement: usize, determinant: f32 },
    #[error("placement {placement} is more than a turn and one scale")]
    NotRigid { placement: usize },
    #[error("the scale of placement {placement} is {scale}, must be {} to {}", SCALES[0], SCALES[1])]
    Scale { placement: usize, scale: f32 },
}

/// One place of an object.
#[derive(Debug, Clone, Copy)]
pub struct Placement {
    world_from_object: Affine3A,
    pub object_from_world: Affine3A,
    /// Metres of the world for one of the object.
    pub scale: f32,
}

/// All places of an object.
#[derive(Debug, Clone)]
pub struct Placements {
    all: Vec<Placement>,
    bounds: Aabb,
}

/// A ray's way into the box of a placement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxEntry {
    pub placement: usize,
    /// The ray's parameter where it enters the box, or begins in it.
    pub t: f32,
}

impl Placements {
    /// # Errors
    /// Too many placements, or the first that is no turn with a scale.
    pub fn new(world_from_object: &[Affine3A], bounds: Aabb) -> Result<Self, PlacementError> {
        if world_from_object.len() > MAX_PLACEMENTS {
            return Err(PlacementError::TooMany { placements: world_from_object.len() });
        }
        let all = world_from_object.iter().enumerate().map(|(number, place)| placement(number, place));
        Ok(Self { all: all.collect::<Result<_, _>>()?, bounds })
    }

    pub fn get(&self, number: usize) -> &Placement {
        &self.all[number]
    }

    /// The boxes that each ray enters. Rays are those of a camera's pixels, row by row: each is tested against the boxes that its tile of
    /// the picture shows.
    pub fn entries_in_view(&self, camera: &PinholeCamera, rays: &[Ray]) -> Vec<Vec<BoxEntry>> {
        let columns = camera.size_px.x.div_ceil(TILE_PX);
        let tiles = self.tiles(camera);
        let numbered = rays.par_iter().enumerate().map(|(number, ray)| {
            let tile = UVec2::new(number as u32 % camera.size_px.x, number as u32 / camera.size_px.x) / TILE_PX;
            self.entries(ray, tiles[(tile.y * columns + tile.x) as usize].iter().copied())
        });
        numbered.collect()
    }

    /// The boxes that each ray enters, of all.
    pub fn entries_of(&self, rays: &[Ray]) -> Vec<Vec<BoxEntry>> {
        rays.par_iter().map(|ray| self.entries(ray, 0..self.all.len())).collect()
    }

    /// Some of the boxes that a ray enters, the nearest first.
    fn entries(&self, ray: &Ray, numbers: impl Iterator<Item = usize>) -> Vec<BoxEntry> {
        let entries = numbers.filter_map(|placement| {
            let t = entry(&self.bounds, &self.all[placement].in_object(ray))?;
            Some(BoxEntry { placement, t })
        });
        let mut entries: Vec<BoxEntry> = entries.collect();
        entries.sort_by(|a, b| a.t.total_cmp(&b.t));
        entries
    }

    /// The placements whose boxes each tile of a picture shows.
    fn tiles(&self, camera: &PinholeCamera) -> Vec<Vec<usize>> {
        let tiles_px = camera.size_px.map(|side_px| side_px.div_ceil(TILE_PX));
        let mut tiles = vec![Vec::new(); tiles_px.element_product() as usize];
        for (number, placement) in self.all.iter().enumerate() {
            let Some([first, last]) = self.shown_in(placement, camera) else { continue };
            for row in first.y / TILE_PX..=last.y / TILE_PX {
                for column in first.x / TILE_PX..=last.x / TILE_PX {
                    tiles[(row * tiles_px.x + column) as usize].push(number);
                }
            }
        }
        tiles
    }

    /// The first and last pixel, along both sides, that a placement's box is shown in; all pixels where a part of it is behind the eye.
    fn shown_in(&self, placement: &Placement, camera: &PinholeCamera) -> Option<[UVec2; 2]> {
        let last_px = camera.size_px - 1;
        let mut first = Vec2::INFINITY;
        let mut last = Vec2::NEG_INFINITY;
        for corner in self.bounds.corners() {
            let Some(at) = camera.project(placement.world_from_object.transform_point3(corner)) else {
                return Some([UVec2::ZERO, last_px]);
            };
            first = first.min(at.pixel);
            last = last.max(at.pixel);
        }
        let is_shown = last.cmpge(Vec2::ZERO).all() && first.cmplt(camera.size_px.as_vec2()).all();
        is_shown.then(|| [first.max(Vec2::ZERO).as_uvec2(), last.as_uvec2().min(last_px)])
    }
}

impl Placement {
    /// Takes a ray to the object's space and keeps its parameters.
    pub fn in_object(&self, ray: &Ray) -> Ray {
        Ray {
            origin_in_world: self.object_from_world.transform_point3(ray.origin_in_world),
            direction_in_world: self.object_from_world.transform_vector3(ray.direction_in_world),
        }
    }
}

fn placement(number: usize, world_from_object: &Affine3A) -> Result<Placement, PlacementError> {
    if !world_from_object.is_finite() {
        return Err(PlacementError::NotFinite { placement: number });
    }
    let axes = world_from_object.matrix3;
    let determinant = axes.determinant();
    if determinant <= 0.0 {
        return Err(PlacementError::Mirroring { placement: number, determinant });
    }
    let scale = determinant.cbrt();
    if !(SCALES[0]..=SCALES[1]).contains(&scale) {
        return Err(PlacementError::Scale { placement: number, scale });
    }
    let squares = axes.transpose() * axes * (scale * scale).recip();
    if !squares.abs_diff_eq(glam::Mat3A::IDENTITY, RIGID) {
        return Err(PlacementError::NotRigid { placement: number });
    }
    Ok(Placement { world_from_object: *world_from_object, object_from_world: world_from_object.inverse(), scale })
}

/// The parameter at which a ray enters a box, if it does not leave the box before it begins.
fn entry(bounds: &Aabb, ray: &Ray) -> Option<f32> {
    let inverse = ray.direction_in_world.recip();
    let to_min = (bounds.min - ray.origin_in_world) * inverse;
    let to_max = (bounds.max - ray.origin_in_world) * inverse;
    let is_along = ray.direction_in_world.cmpeq(Vec3::ZERO);
    let is_beside = ray.origin_in_world.cmplt(bounds.min) | ray.origin_in_world.cmpgt(bounds.max);
    if (is_along & is_beside).any() {
        return None;
    }
    let first = Vec3::select(is_along, Vec3::NEG_INFINITY, to_min.min(to_max)).max_element().max(0.0);
    let last = Vec3::select(is_along, Vec3::INFINITY, to_min.max(to_max)).min_element();
    (first < last).then_some(first)
}

#[cfg(test)]
mod tests {
    use glam::{Mat3A, Quat, Vec3A};

    use super::*;
    use crate::impostors::rays::unit_rays;

    const BOX: Aabb = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };

    fn error(world_from_object: Affine3A) -> PlacementError {
        Placements::new(&[Affine3A::IDENTITY, world_from_object], BOX).unwrap_err()
    }

    #[test]
    fn placements_that_are_no_turn_with_a_scale_are_refused_by_number() {
        let scaled = |x: f32, y: f32, z: f32| Affine3A::from_scale(Vec3::new(x, y, z));
        assert_eq!(error(scaled(f32::NAN, 1.0, 1.0)), PlacementError::NotFinite { placement: 1 });
        assert!(matches!(error(scaled(-1.0, 1.0, 1.0)), PlacementError::Mirroring { placement: 1, .. }));
        assert!(matches!(error(scaled(1.0, 0.0, 1.0)), PlacementError::Mirroring { placement: 1, .. }));
        assert_eq!(error(scaled(1.0, 2.0, 1.0)), PlacementError::NotRigid { placement: 1 });
        let sheared = Affine3A::from_mat3(Mat3A::from_cols(Vec3A::X, Vec3A::new(0.2, 1.0, 0.0), Vec3A::Z).into());
        assert_eq!(error(sheared), PlacementError::NotRigid { placement: 1 });
        assert!(matches!(error(scaled(1e5, 1e5, 1e5)), PlacementError::Scale { placement: 1, .. }));
        let many = vec![Affine3A::IDENTITY; MAX_PLACEMENTS + 1];
        let too_many = Placements::new(&many, BOX).unwrap_err();
        assert_eq!(too_many.to_string(), "4097 placements, at most 4096");
        assert!(Placements::new(&many[1..], BOX).is_ok());
    }

    #[test]
    fn a_ray_enters_boxes_in_order_and_keeps_its_parameter() {
        let turned = Quat::from_rotation_y(0.5 * std::f32::consts::FRAC_PI_2);
        let places =
            [0.0, -8.0].map(|z| Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), turned, Vec3::Z * z));
        let placements = Placements::new(&places, BOX).unwrap();
        let ray = Ray { origin_in_world: Vec3::Z * 20.0, direction_in_world: Vec3::NEG_Z };
        let entries = placements.entries_of(&[ray]).remove(0);
        let corner_m = 2.0 * std::f32::consts::SQRT_2;
        assert_eq!(entries.iter().map(|entry| entry.placement).collect::<Vec<_>>(), [0, 1]);
        assert!((entries[0].t - (20.0 - corner_m)).abs() < 1e-3 && (entries[1].t - (28.0 - corner_m)).abs() < 1e-3);
        let inside = Ray { origin_in_world: Vec3::ZERO, direction_in_world: Vec3::X };
        assert_eq!(placements.entries_of(&[inside])[0][0].t, 0.0);
        let beside = Ray { origin_in_world: Vec3::Y * 2.5, direction_in_world: Vec3::X };
        assert!(placements.entries_of(&[beside])[0].is_empty());
    }

    /// Also of boxes that the picture cuts, and around the eye.
    #[test]
    fn tiles_of_a_picture_miss_no_box() {
        let eye = Vec3::new(3.0, 2.0, 4.0);
        let places = (0..60).map(|number| {
            let at = Vec3::new((number % 8) as f32 - 3.5, 0.0, (number / 8) as f32 - 4.0) * 2.0;
            let turn = Quat::from_rotation_y(0.3 * number as f32);
            Affine3A::from_scale_rotation_translation(Vec3::splat(0.6), turn, at)
        });
        let places: Vec<Affine3A> = places.chain([Affine3A::from_translation(eye)]).collect();
        let placements = Placements::new(&places, BOX).unwrap();
        let camera = PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(61, 43));
        let rays: Vec<Ray> = unit_rays(&camera).collect();
        let in_view = placements.entries_in_view(&camera, &rays);
        assert_eq!(in_view, placements.entries_of(&rays));
        assert!(in_view.iter().map(Vec::len).max() > Some(3));
    }
}
