//! Images of a body's inside: its backs, by pinholes around its box. A ray inside is searched in each of them. The images show one side
//! of the surface alone, so that none of them tells another one's free space.

use depth_image::{PinholeCamera, Ray};
use glam::{DVec3, UVec2, Vec3};
use rayon::prelude::*;

use super::body::{Body, Emerged, Entry};
use crate::graph::{GraphCamera, GraphHit, GraphImage, GraphSearch, pinhole};

const IMAGES: u32 = 8;
const IMAGE_PX: UVec2 = UVec2::splat(256);
/// From the middle of the box, in half diagonals.
const DISTANCE: f32 = 2.5;
const SEARCH: GraphSearch = GraphSearch { coarse_px: 6.0, fine_px: 1.0 };
/// Total reflections that are followed, and the surface through which the ray leaves.
const MOST_WALKS: u32 = 5;
/// Images whose ends lie no farther behind the first end, in shares of the body's size, show the same surface.
const SAME_END: f64 = 0.02;

/// The images of one body.
pub struct InsideImages<'c> {
    images: Vec<GraphImage<'c>>,
}

/// Cameras around a body's box.
///
/// # Errors
/// A camera cannot be used.
pub fn cameras(body: &Body) -> anyhow::Result<Vec<GraphCamera>> {
    let middle = body.bounds.center();
    let half_m = 0.5 * body.bounds.size().length();
    let fov_y_rad = 2.0 * (1.0 / DISTANCE).asin();
    let cameras = (0..IMAGES).map(|corner| {
        let out = Vec3::from([0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 }));
        let eye = middle + out.normalize_or_zero() * (DISTANCE * half_m);
        pinhole(&PinholeCamera::looking_at(eye, middle, Vec3::Y, fov_y_rad, IMAGE_PX))
    });
    cameras.collect()
}

impl<'c> InsideImages<'c> {
    pub fn take(cameras: &'c [GraphCamera], body: &Body) -> Self {
        let images = cameras.iter().map(|camera| GraphImage::take(camera, |ray, span| body.meet_back(ray, span)));
        Self { images: images.collect() }
    }

    pub fn texels(&self) -> usize {
        self.images.iter().map(|image| image.camera.texels()).sum()
    }

    /// Follows rays through the body. Where no image knows the second surface, there is none.
    pub fn emerged(&self, body: &Body, entries: &[Entry]) -> Vec<Emerged> {
        entries.par_iter().map(|entry| self.emerged_of(body, entry)).collect()
    }

    fn emerged_of(&self, body: &Body, entry: &Entry) -> Emerged {
        let mut emerged = body.by_one_interface(entry);
        for _ in 0..MOST_WALKS {
            let Some(end) = self.end(&emerged.ray, body) else { break };
            let normal = end.normal_in_world.as_vec3();
            emerged = body.leave(&emerged.ray, end.way_m as f32, normal, emerged.throughput_linear);
            if !emerged.is_reflected {
                break;
            }
        }
        emerged
    }

    /// Chooses among the images that meet the first surface the one that sees it most from the front.
    fn end(&self, ray: &Ray, body: &Body) -> Option<GraphHit> {
        let ends = self.images.iter().filter_map(|image| {
            let hit = image.follow(ray, f64::from(body.near_m()), SEARCH).met?;
            let point = ray.origin_in_world.as_dvec3() + ray.direction_in_world.as_dvec3() * hit.way_m;
            let to_eye: DVec3 = (image.camera.frusta[0].eye_in_world - point).normalize_or_zero();
            Some((hit, to_eye.dot(hit.normal_in_world)))
        });
        let ends: Vec<(GraphHit, f64)> = ends.collect();
        let first_m = ends.iter().map(|(hit, _)| hit.way_m).fold(f64::INFINITY, f64::min);
        let last_m = first_m + SAME_END * f64::from(body.bounds.size().length());
        let same = ends.into_iter().filter(|(hit, _)| hit.way_m <= last_m);
        same.max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(hit, _)| hit)
    }
}
