//! Parks of cars and of barrels in the sun: by reliefs on a floor, and by rays among all triangles.

use depth_image::{PinholeCamera, Ray, ToneMapping, View, linear_from_srgb8};
use fixtures::{CAR_SRGB, CAR_TINTS_SRGB, barrel, barrel_places, barrels, car, car_park, car_places, park_floor};
use glam::{Affine3A, UVec2, Vec3};
use rayon::prelude::*;
use scene::Scene;

use super::placements::Placements;
use super::relief::{NEAR_M, Relief, ReliefHit, ReliefImages};
use super::sun::{SUN, SunMap};
use crate::failures::stand::Stand;
use crate::impostors::rays::unit_rays;
use crate::impostors::surfaces::{SKY_SRGB, Surfaces};

/// What is left of a colour in the shadow.
const SHADOW: f32 = 0.45;
/// Shadow rays begin so far from the surface.
const LIFT_M: f32 = 0.02;
const FAR_M: f32 = 1e3;
/// From the middle of a park.
const VIEW_FROM: Vec3 = Vec3::new(0.75, 0.5, 1.05);
const FOV_RAD: f32 = 0.5;

/// Objects of one kind on a floor.
pub struct Park {
    pub name: String,
    object: Scene,
    places: Vec<Affine3A>,
    /// Colours in turn, in place of that of a car's body.
    tints_srgb: &'static [Vec3],
}

/// A picture and its pixels in the shadow.
pub struct ParkPicture {
    pub view: View,
    pub in_shadow: Vec<bool>,
}

/// A picture by reliefs.
pub struct ReliefPicture {
    pub drawn: ParkPicture,
    /// The share of pixels that show a relief.
    pub relief_ratio: f64,
    pub view_s: f64,
    pub sun_map_s: f64,
}

/// What a pixel shows.
#[derive(Clone, Copy)]
struct ShownSurface {
    at: Vec3,
    color_linear: Vec3,
}

/// A park whose objects are reliefs.
pub struct ReliefPark<'s> {
    park: &'s Park,
    relief: Relief<'s>,
    placements: Placements,
    floor: Surfaces,
}

impl Park {
    pub fn of_cars(cars: u32) -> Self {
        let name = format!("car-park:{cars}");
        Self { name, object: car(), places: car_places(cars), tints_srgb: &CAR_TINTS_SRGB }
    }

    pub fn of_barrels(barrels: u32) -> Self {
        let name = format!("barrels:{barrels}");
        Self { name, object: barrel(), places: barrel_places(barrels), tints_srgb: &[] }
    }

    pub fn count(&self) -> u32 {
        self.places.len() as u32
    }

    pub fn triangles(&self) -> u64 {
        u64::from(self.count()) * self.object.triangle_count()
    }

    /// The farthest point of an object, from the park's middle.
    pub fn reach_m(&self) -> f32 {
        let half_m = 0.5 * self.object.bounds().size().length();
        self.places.iter().map(|place| place.translation.length()).fold(0.0, f32::max) + half_m
    }

    /// A viewer beside the park, who sees all of it.
    pub fn view(&self, size_px: UVec2) -> PinholeCamera {
        let eye = VIEW_FROM.normalize_or_zero() * (2.2 * self.reach_m());
        PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, FOV_RAD, size_px)
    }

    /// Draws a picture with its shadows by rays among all triangles.
    ///
    /// # Errors
    /// The device fails.
    pub fn draw_triangles(&self, stand: &Stand, camera: &PinholeCamera) -> anyhow::Result<ParkPicture> {
        let scene = if self.tints_srgb.is_empty() { barrels(self.count()) } else { car_park(self.count()) };
        let surfaces = Surfaces::new(&stand.upload(&scene)?)?;
        let shown = unit_rays(camera).map(|ray| {
            let met = surfaces.meet(&ray, [NEAR_M, FAR_M])?;
            Some(ShownSurface { at: ray.at(met.t), color_linear: met.color_linear })
        });
        let shown: Vec<Option<ShownSurface>> = shown.collect();
        let in_shadow = shown.par_iter().map(|shown| {
            shown.is_some_and(|shown| {
                let direction_in_world = SUN.normalize_or_zero();
                let origin_in_world = shown.at + direction_in_world * LIFT_M;
                surfaces.is_blocked(&Ray { origin_in_world, direction_in_world }, FAR_M)
            })
        });
        Ok(drawn(camera.size_px, &shown, in_shadow.collect()))
    }
}

impl<'s> ReliefPark<'s> {
    /// # Errors
    /// The placements cannot be used, or the device fails.
    pub fn new(stand: &'s Stand, park: &'s Park, images: ReliefImages) -> anyhow::Result<Self> {
        let relief = Relief::take(stand, &park.object, images)?;
        let placements = Placements::new(&park.places, relief.bounds)?;
        Ok(Self { park, relief, placements, floor: Surfaces::new(&stand.upload(&park_floor(&park.places))?)? })
    }

    /// # Errors
    /// The device fails.
    pub fn draw(&self, camera: &PinholeCamera) -> anyhow::Result<ReliefPicture> {
        let sun = SunMap::draw(&self.relief, &self.placements, self.park.reach_m())?;
        let rays: Vec<Ray> = unit_rays(camera).collect();
        let reliefs = self.relief.draw(&self.placements, camera, &rays)?;
        let shown: Vec<Option<ShownSurface>> =
            rays.par_iter().zip(&reliefs.hits).map(|(ray, hit)| self.shown(ray, hit.as_ref())).collect();
        let in_shadow = shown.par_iter().map(|shown| shown.is_some_and(|shown| sun.is_in_shadow(shown.at)));
        let hits = reliefs.hits.iter().flatten().count();
        Ok(ReliefPicture {
            relief_ratio: hits as f64 / rays.len().max(1) as f64,
            view_s: reliefs.seconds,
            sun_map_s: sun.seconds,
            drawn: drawn(camera.size_px, &shown, in_shadow.collect()),
        })
    }

    /// The relief or the floor, by their depths in the world.
    fn shown(&self, ray: &Ray, hit: Option<&ReliefHit>) -> Option<ShownSurface> {
        let floor = self.floor.meet(ray, [NEAR_M, FAR_M]);
        match hit {
            Some(hit) if floor.is_none_or(|floor| floor.t > hit.t) => {
                Some(ShownSurface { at: ray.at(hit.t), color_linear: self.tinted(hit) })
            }
            _ => floor.map(|floor| ShownSurface { at: ray.at(floor.t), color_linear: floor.color_linear }),
        }
    }

    /// The share of the body's yellow in a colour becomes the tint; between samples of two surfaces it is a part.
    fn tinted(&self, hit: &ReliefHit) -> Vec3 {
        let tints = self.park.tints_srgb;
        if tints.is_empty() {
            return hit.color_linear;
        }
        let key_linear = linear(CAR_SRGB);
        let share = (yellow(hit.color_linear) / yellow(key_linear)).min(1.0);
        let tint_linear = linear(tints[hit.placement % tints.len()]);
        (hit.color_linear + (tint_linear - key_linear) * share).max(Vec3::ZERO)
    }
}

/// Pixels in either shadow that are in both.
pub fn shadow_iou(a: &ParkPicture, b: &ParkPicture) -> f64 {
    let pairs = a.in_shadow.iter().zip(&b.in_shadow);
    let both = pairs.clone().filter(|(a, b)| **a && **b).count();
    let either = pairs.filter(|(a, b)| **a || **b).count();
    both as f64 / either.max(1) as f64
}

fn yellow(color: Vec3) -> f32 {
    (color.x.min(color.y) - color.z).max(0.0)
}

fn linear(color_srgb: Vec3) -> Vec3 {
    color_srgb.map(|channel| linear_from_srgb8(channel as u8))
}

fn drawn(size_px: UVec2, shown: &[Option<ShownSurface>], in_shadow: Vec<bool>) -> ParkPicture {
    let pixels = shown.iter().zip(&in_shadow).flat_map(|(shown, is_dark)| {
        let light = if *is_dark { SHADOW } else { 1.0 };
        shown.map_or(SKY_SRGB, |shown| ToneMapping::NONE.srgb8(shown.color_linear * light))
    });
    ParkPicture { view: View::from_srgb8(size_px, pixels.collect()), in_shadow }
}
