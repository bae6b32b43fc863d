//! The scalar reference of this crate: one ray a pixel, one after the other, which goes on behind redundant samples.

mod candidate;
mod coverage;
mod depth_peeling;
mod pixel;
mod texel;
mod visibility;

use depth_image::{BACKGROUND_INVERSE_DEPTH, Camera, DepthImage, HOLE_INVERSE_DEPTH, PinholeCamera, oct16_from_unit};
use glam::UVec2;
use render::scalar::MOST_LAYERS;
use render::scalar::rays::{Scene, pixel_ray};

use self::{coverage::Surfaces, depth_peeling::is_in_layer, texel::Texel};
use crate::methods::{Redundancy, SamplingMethod};

pub use candidate::Candidate;
pub use pixel::{holds, is_pixel_redundant};
pub use visibility::is_visibility_redundant;

/// Depth, normals and surface ids of a set; colours are left black.
#[must_use]
pub fn sample(scene: &Scene, cameras: &[PinholeCamera], method: SamplingMethod) -> Vec<DepthImage> {
    let surfaces: Vec<Surfaces> = match method.omits_covered_pixels() {
        true => cameras.iter().map(|camera| Surfaces::of(scene, camera)).collect(),
        false => Vec::new(),
    };
    let mut images: Vec<DepthImage> = Vec::with_capacity(cameras.len());
    for (number, camera) in cameras.iter().enumerate() {
        let query = Query { scene, images: &images, surfaces: &surfaces[..number.min(surfaces.len())], method };
        let pixels = (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| UVec2::new(x, y)));
        let texels: Vec<Texel> = pixels.map(|pixel| texel(&query, camera, pixel)).collect();
        images.push(image(camera, &texels));
    }
    images
}

/// The evidence that a candidate is compared with.
struct Query<'a> {
    scene: &'a Scene,
    /// The images before the candidate's own.
    images: &'a [DepthImage],
    /// The surfaces that these would show without any redundancy.
    surfaces: &'a [Surfaces],
    method: SamplingMethod,
}

fn texel(query: &Query<'_>, camera: &PinholeCamera, pixel: UVec2) -> Texel {
    let scene = query.scene;
    let ray = pixel_ray(camera, pixel);
    let mut near = camera.near_m;
    let mut has_passed = false;
    for _ in 0..MOST_LAYERS {
        let Some(hit) = scene.closest(&ray, near) else { break };
        let candidate = Candidate::of(scene, camera, pixel, &ray, &hit);
        if query.surfaces.iter().any(|surfaces| surfaces.cover(&candidate, camera)) {
            return Texel::empty(HOLE_INVERSE_DEPTH, false);
        }
        if !query.images.iter().any(|image| is_redundant(query, &candidate, image)) {
            let id = candidate.id;
            let normal_oct16 = oct16_from_unit(candidate.normal);
            return Texel { inverse_depth_per_m: hit.t.recip(), normal_oct16, id, has_passed };
        }
        (near, has_passed) = (hit.t, true);
    }
    Texel::empty(if has_passed { HOLE_INVERSE_DEPTH } else { BACKGROUND_INVERSE_DEPTH }, has_passed)
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
            .any(|texel| texel.has_passed)
            .then(|| texels.iter().map(|texel| texel.has_passed).collect()),
        corner_inverse_depth_per_m: None,
        light: None,
    }
}

fn is_redundant(query: &Query<'_>, candidate: &Candidate, image: &DepthImage) -> bool {
    match query.method {
        SamplingMethod::Conventional(_)
        | SamplingMethod::LayeredCube(_)
        | SamplingMethod::NonRedundant(Redundancy::Coverage) => false,
        SamplingMethod::NonRedundant(Redundancy::Pixel) => is_pixel_redundant(candidate, image),
        SamplingMethod::NonRedundant(Redundancy::Visibility) => {
            let camera = image.camera.reference();
            is_visibility_redundant(query.scene, candidate.point_in_world, candidate.footprint_m, camera)
        }
        SamplingMethod::DepthPeeling { .. } => is_in_layer(candidate, image),
    }
}
