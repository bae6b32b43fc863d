//! An object as images of it, drawn at many places: each ray is taken to the object's space where it enters a placement's box, and is
//! followed in the images there (Rosen et al., section 6.2).

use std::time::Instant;

use depth_image::{Aabb, Camera, DepthImage, Environment, PinholeCamera, ProvenanceKind, Ray, SinglePoleCamera};
use glam::{UVec2, Vec3};
use gpu::Turn;
use reconstruction::{RayEnd, RayWork, SampleSet};
use render::{Lighting, SamplePlanes};
use scene::Scene;

use super::placements::{BoxEntry, Placements};
use crate::failures::stage::in_the_dark;
use crate::failures::stand::Stand;

/// Rays meet nothing nearer to their origin, or to where they enter a box.
pub const NEAR_M: f32 = 1e-3;
/// Texels of all images of an object.
const TEXELS: f32 = 262_144.0;
const SIDE_PX: UVec2 = UVec2::splat(512);
/// Eyes lie this far from the middle of the object, in half diagonals of its box.
const DISTANCE: f32 = 2.5;
/// The elevation of four pinholes around.
const ELEVATION_DEG: f32 = 35.0;
/// The most rays that are followed at once.
const RAYS_AT_ONCE: usize = 1 << 18;
/// The surface of an object lies this far inside its box at least, in shares of the box's size.
const BOX_SLACK: f32 = 0.005;

/// The images of an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReliefImages {
    /// One pinhole above, as for conventional relief textures.
    Pinhole,
    /// One single pole above, with this distortion in half sides.
    SinglePole(f32),
    /// One single pole above each long side.
    TwoSinglePoles(f32),
    /// Four pinholes around.
    FourPinholes,
}

/// An object's images on the device, and its box.
pub struct Relief<'s> {
    stand: &'s Stand,
    set: SampleSet,
    pub bounds: Aabb,
    pub texels: usize,
}

/// What a ray meets.
#[derive(Debug, Clone, Copy)]
pub struct ReliefHit {
    /// The ray's parameter.
    pub t: f32,
    pub placement: usize,
    pub color_linear: Vec3,
}

/// The ends of rays, and the time of their search, with that of boxes.
pub struct ReliefHits {
    pub hits: Vec<Option<ReliefHit>>,
    pub seconds: f64,
}

impl ReliefImages {
    fn cameras(self, bounds: &Aabb) -> Vec<Camera> {
        let middle = bounds.center();
        let away_m = DISTANCE * 0.5 * bounds.size().length();
        let above = middle + Vec3::Y * away_m;
        let cameras = match self {
            Self::Pinhole => vec![SinglePoleCamera::around(bounds, above, 0.0, SIDE_PX).reference.into()],
            Self::SinglePole(distortion) => vec![single_pole(bounds, above, distortion)],
            Self::TwoSinglePoles(distortion) => [-1.0, 1.0]
                .map(|side| {
                    single_pole(bounds, middle + Vec3::new(0.0, 1.0, side).normalize_or_zero() * away_m, distortion)
                })
                .into(),
            Self::FourPinholes => (0..4).map(|side| from_side(bounds, side).into()).collect(),
        };
        Camera::resized_together(&cameras, TEXELS, 1)
    }
}

fn single_pole(bounds: &Aabb, eye: Vec3, distortion: f32) -> Camera {
    let distortion_px = distortion * 0.5 * SIDE_PX.x as f32;
    Camera::SinglePole(SinglePoleCamera::around(bounds, eye, distortion_px, SIDE_PX))
}

/// A pinhole that looks down at a box from one of four sides.
fn from_side(bounds: &Aabb, side: u32) -> PinholeCamera {
    let middle = bounds.center();
    let half_m = 0.5 * bounds.size().length();
    let elevation = ELEVATION_DEG.to_radians();
    let level = Vec3::Z.rotate_y(std::f32::consts::FRAC_PI_2 * (side as f32 + 0.5));
    let out = level * elevation.cos() + Vec3::Y * elevation.sin();
    let fov_y_rad = 2.0 * (1.0 / DISTANCE).asin();
    PinholeCamera::looking_at(middle + out * (DISTANCE * half_m), middle, Vec3::Y, fov_y_rad, SIDE_PX)
}

impl<'s> Relief<'s> {
    /// Takes images of an object in its own colours.
    ///
    /// # Errors
    /// The device fails.
    pub fn take(stand: &'s Stand, object: &Scene, images: ReliefImages) -> anyhow::Result<Self> {
        let bounds = object.bounds();
        let on_device = stand.upload(object)?;
        let cameras = images.cameras(&bounds);
        let images: Vec<DepthImage> = stand.images(&on_device, Lighting::UNLIT, &cameras, SamplePlanes::default())?;
        let description = in_the_dark(bounds, Environment::uniform(Vec3::ZERO));
        let set = stand.reconstructor().upload(&images, &description, Turn::default())?;
        let slack = bounds.size() * BOX_SLACK;
        let texels = images.iter().map(|image| image.camera.pixel_count()).sum();
        Ok(Self { stand, set, bounds: Aabb { min: bounds.min - slack, max: bounds.max + slack }, texels })
    }

    /// Follows the rays of a camera's pixels, of unit length, among the placements.
    ///
    /// # Errors
    /// The device fails.
    pub fn draw(&self, placements: &Placements, camera: &PinholeCamera, rays: &[Ray]) -> anyhow::Result<ReliefHits> {
        let start = Instant::now();
        let hits = self.follow(placements, rays, &placements.entries_in_view(camera, rays))?;
        Ok(ReliefHits { hits, seconds: start.elapsed().as_secs_f64() })
    }

    /// Follows rays of unit length in the boxes that they enter.
    ///
    /// # Errors
    /// The device fails.
    pub fn follow(
        &self,
        placements: &Placements,
        rays: &[Ray],
        boxes: &[Vec<BoxEntry>],
    ) -> anyhow::Result<Vec<Option<ReliefHit>>> {
        let mut hits: Vec<Option<ReliefHit>> = vec![None; rays.len()];
        for round in 0.. {
            let in_boxes: Vec<RayInBox> = boxes
                .iter()
                .enumerate()
                .filter_map(|(ray, boxes)| Some(RayInBox { ray, entry: *boxes.get(round)? }))
                .filter(|in_box| hits[in_box.ray].is_none_or(|hit| hit.t > in_box.entry.t))
                .collect();
            if in_boxes.is_empty() {
                break;
            }
            for chunk in in_boxes.chunks(RAYS_AT_ONCE) {
                self.follow_in_boxes(placements, rays, chunk, &mut hits)?;
            }
        }
        Ok(hits)
    }

    fn follow_in_boxes(
        &self,
        placements: &Placements,
        rays: &[Ray],
        in_boxes: &[RayInBox],
        hits: &mut [Option<ReliefHit>],
    ) -> anyhow::Result<()> {
        let in_object: Vec<Ray> = in_boxes.iter().map(|in_box| in_box.in_object(placements, rays)).collect();
        let (ends, _) = self.stand.reconstructor().follow(RayWork::new(&self.set, NEAR_M), &in_object)?;
        for (in_box, end) in in_boxes.iter().zip(ends) {
            let hit = in_box.hit(placements, &end);
            let nearest = &mut hits[in_box.ray];
            if hit.is_some_and(|hit| nearest.is_none_or(|nearest| nearest.t > hit.t)) {
                *nearest = hit;
            }
        }
        Ok(())
    }
}

/// A ray, by its number, and a box that it enters.
#[derive(Clone, Copy)]
struct RayInBox {
    ray: usize,
    entry: BoxEntry,
}

impl RayInBox {
    /// The ray from the box on, of unit length in the object's space.
    fn in_object(&self, placements: &Placements, rays: &[Ray]) -> Ray {
        let ray = placements.get(self.entry.placement).in_object(&rays[self.ray]);
        Ray { origin_in_world: ray.at(self.entry.t), direction_in_world: ray.direction_in_world.normalize_or_zero() }
    }

    fn hit(&self, placements: &Placements, end: &RayEnd) -> Option<ReliefHit> {
        let BoxEntry { placement, t } = self.entry;
        (end.kind == ProvenanceKind::Hit).then(|| ReliefHit {
            t: t + end.way_m * placements.get(placement).scale,
            placement,
            color_linear: end.color_linear,
        })
    }
}
