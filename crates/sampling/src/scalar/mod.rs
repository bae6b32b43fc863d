//! The scalar reference of this crate: one ray a pixel, one after the other, which goes on behind redundant samples.

mod candidate;
mod depth_peeling;
mod pixel;
mod texel;
mod tolerance;
mod useful;
mod visibility;

use depth_image::{
    BACKGROUND_INVERSE_DEPTH, Camera, DepthImage, HOLE_INVERSE_DEPTH, PinholeCamera, SurfaceId, oct16_from_unit,
};
use glam::UVec2;
use render::scalar::MOST_LAYERS;
use render::scalar::rays::{Scene, pixel_ray};
use render::view_cell_m;

use self::tolerance::{is_tolerance_redundant, was_kept};
use self::{depth_peeling::is_in_layer, texel::Texel, useful::omit_useless};
use crate::methods::{Redundancy, SamplingMethod};

pub use candidate::Candidate;
pub use pixel::{holds, is_pixel_redundant};
pub use visibility::is_visibility_redundant;

/// Depth, normals and surface ids of a set; colours are left black.
#[must_use]
pub fn sample(scene: &Scene, cameras: &[PinholeCamera], method: SamplingMethod) -> Vec<DepthImage> {
    sample_with(scene, cameras, method, Settings::default())
}

/// Variations of the test by tolerance.
#[derive(Debug, Clone, Copy)]
pub struct Settings<'a> {
    /// The same images at the reference time.
    pub reference: Option<&'a [DepthImage]>,
    /// A factor on the differences of depth and footprint that the method allows.
    pub allowed: f32,
}

impl Default for Settings<'_> {
    fn default() -> Self {
        Self { reference: None, allowed: 1.0 }
    }
}

/// As [`sample`], with the test by tolerance varied.
#[must_use]
pub fn sample_with(
    scene: &Scene,
    cameras: &[PinholeCamera],
    method: SamplingMethod,
    settings: Settings<'_>,
) -> Vec<DepthImage> {
    let mut images: Vec<DepthImage> = Vec::with_capacity(cameras.len());
    for (number, camera) in cameras.iter().enumerate() {
        let reference = settings.reference.map(|reference| &reference[number]);
        let query = Query { scene, images: &images, method, reference, allowed: settings.allowed };
        let pixels = (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| UVec2::new(x, y)));
        let mut texels: Vec<Texel> = pixels.map(|pixel| texel(&query, camera, pixel)).collect();
        if let SamplingMethod::Useful(_) = method {
            omit_useless(&mut texels, camera, view_cell_m(cameras));
        }
        images.push(image(camera, &texels));
    }
    images
}

/// The evidence that a candidate is compared with.
struct Query<'a> {
    scene: &'a Scene,
    /// The images before the candidate's own.
    images: &'a [DepthImage],
    method: SamplingMethod,
    /// The candidate's own image, at the reference time.
    reference: Option<&'a DepthImage>,
    allowed: f32,
}

fn texel(query: &Query<'_>, camera: &PinholeCamera, pixel: UVec2) -> Texel {
    let scene = query.scene;
    let ray = pixel_ray(camera, pixel);
    let mut near = camera.near_m;
    let mut passed_m = None;
    for _ in 0..MOST_LAYERS {
        let Some(hit) = scene.closest(&ray, near) else { break };
        let candidate = Candidate::of(scene, camera, pixel, &ray, &hit);
        let was_kept = query.reference.is_some_and(|reference| was_kept(&candidate, reference));
        if !query.images.iter().any(|image| is_redundant(query, &candidate, was_kept, image)) {
            let id = candidate.id;
            let normal_oct16 = oct16_from_unit(candidate.normal);
            return Texel { inverse_depth_per_m: hit.t.recip(), normal_oct16, id, passed_m };
        }
        (near, passed_m) = (hit.t, passed_m.or(Some(hit.t)));
    }
    let inverse_depth_per_m = if passed_m.is_some() { HOLE_INVERSE_DEPTH } else { BACKGROUND_INVERSE_DEPTH };
    Texel { inverse_depth_per_m, normal_oct16: 0, id: SurfaceId { instance: 0, primitive: 0 }, passed_m }
}

fn image(camera: &PinholeCamera, texels: &[Texel]) -> DepthImage {
    DepthImage {
        camera: Camera::Pinhole(*camera),
        inverse_depth_per_m: texels.iter().map(|texel| texel.inverse_depth_per_m).collect(),
        color_rgb9e5: vec![0; texels.len()],
        normal_oct16: Some(texels.iter().map(|texel| texel.normal_oct16).collect()),
        surface_id: Some(texels.iter().map(|texel| texel.id).collect()),
        specular: None,
        passed: texels
            .iter()
            .any(|texel| texel.passed_m.is_some())
            .then(|| texels.iter().map(|texel| texel.passed_m.is_some()).collect()),
        corner_inverse_depth_per_m: None,
        light: None,
    }
}

fn is_redundant(query: &Query<'_>, candidate: &Candidate, was_kept: bool, image: &DepthImage) -> bool {
    match query.method {
        SamplingMethod::Conventional(_) | SamplingMethod::LayeredCube(_) => false,
        SamplingMethod::NonRedundant(Redundancy::Pixel) | SamplingMethod::Useful(Redundancy::Pixel) => {
            is_pixel_redundant(candidate, image)
        }
        SamplingMethod::NonRedundant(Redundancy::Visibility) | SamplingMethod::Useful(Redundancy::Visibility) => {
            let camera = image.camera.reference();
            is_visibility_redundant(query.scene, candidate.point_in_world, candidate.footprint_m, camera)
        }
        SamplingMethod::NonRedundant(Redundancy::Tolerance) | SamplingMethod::Useful(Redundancy::Tolerance) => {
            is_tolerance_redundant(candidate, was_kept, query.allowed, image)
        }
        SamplingMethod::DepthPeeling { .. } => is_in_layer(candidate, image),
    }
}
