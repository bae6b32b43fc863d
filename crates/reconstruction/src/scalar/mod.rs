//! The scalar twin of every method: the same data, one pixel after another, in plain `f32`.
//!
//! An oracle for tests, written to be read beside the shaders; it is slow and takes only what
//! [`crate::Reconstructor::upload`] accepts.

mod draw;
mod fill;
mod hybrid_mesh;
mod joint_carve;
mod light_field_search;
mod march;
mod mesh;
mod pixel;
mod sample_camera;
mod specular;
mod surface;
mod tile_start;
mod view_ray;

use depth_image::{Aabb, DepthImage, Environment, PinholeCamera, ProvenanceKind, View, srgb8_from_linear};
use glam::Vec3;

use self::{pixel::Pixel, sample_camera::SampleCamera, view_ray::ViewRays};
use crate::{methods::ReconstructionMethod, pyramid::is_among_holes, quads::Quad, sample_set::SetDescription};

/// One view with depth and provenance.
#[must_use]
pub fn reconstruct(
    images: &[DepthImage],
    set: &SetDescription<'_>,
    camera: &PinholeCamera,
    method: ReconstructionMethod,
) -> View {
    let cameras = nearest_first(images, camera);
    let rays = ViewRays::of(camera, &set.volume, images);
    if let Some(quads) = quads(images, method) {
        let pixels = draw::drawn(&quads, images, &cameras, camera, &rays, set.background.zenith_linear);
        return finished(pixels, images, set, &cameras, &rays);
    }
    let starts = tile_start::tile_starts(&cameras, &rays);
    let pixels = pixels_from(&cameras, &rays, &starts, set.background.zenith_linear, method);
    finished(pixels, images, set, &cameras, &rays)
}

/// As [`reconstruct`], but each ray is followed from where it enters the volume. Tile starts must not change the view,
/// except for the space that no camera sees. For methods that follow rays.
#[must_use]
pub fn reconstruct_from_entry(
    images: &[DepthImage],
    set: &SetDescription<'_>,
    camera: &PinholeCamera,
    method: ReconstructionMethod,
) -> View {
    let cameras = nearest_first(images, camera);
    let rays = ViewRays::of(camera, &set.volume, images);
    let starts = vec![0.0; rays.tiles().element_product() as usize];
    let pixels = pixels_from(&cameras, &rays, &starts, set.background.zenith_linear, method);
    finished(pixels, images, set, &cameras, &rays)
}

/// For each tile of 8 × 8 pixels, row by row, the planar depth in metres up to which its rays need not be
/// searched.
#[must_use]
pub fn tile_starts_m(images: &[DepthImage], volume: &Aabb, camera: &PinholeCamera) -> Vec<f32> {
    tile_start::tile_starts(&nearest_first(images, camera), &ViewRays::of(camera, volume, images))
}

/// The quads that a method draws, image after image in the order of their samples; `None` for methods that draw none.
/// Images without the planes that the method needs give none.
#[must_use]
pub fn quads(images: &[DepthImage], method: ReconstructionMethod) -> Option<Vec<Quad>> {
    let images = || images.iter().enumerate();
    match method {
        ReconstructionMethod::Mesh => Some(images().flat_map(|(n, image)| mesh::quads(n, image)).collect()),
        ReconstructionMethod::HybridMesh { merged } => {
            Some(images().flat_map(|(n, image)| hybrid_mesh::quads(n, image, merged)).collect())
        }
        ReconstructionMethod::LightFieldSearch { .. } | ReconstructionMethod::JointCarve { .. } => None,
    }
}

/// Camera 0 is the nearest to the view's eye and so knows most; each keeps its bit. Images that do not prove all ways
/// free come after those that do.
fn nearest_first(images: &[DepthImage], camera: &PinholeCamera) -> Vec<SampleCamera> {
    let among_holes = is_among_holes(images);
    let camera_of = |(bit, image): (u32, &DepthImage)| SampleCamera::of(image, 1 << bit, among_holes);
    let mut cameras: Vec<_> = (0..).zip(images).map(camera_of).collect();
    let distance = |c: &SampleCamera| c.eye_in_world.distance_squared(camera.eye_in_world);
    cameras.sort_by(|a, b| a.has_uncertain().cmp(&b.has_uncertain()).then(distance(a).total_cmp(&distance(b))));
    cameras
}

/// The pixels that the method finds, row by row.
fn pixels_from(
    cameras: &[SampleCamera],
    rays: &ViewRays,
    starts: &[f32],
    background_linear: Vec3,
    method: ReconstructionMethod,
) -> Vec<Pixel> {
    let background_srgb8 = background_linear.to_array().map(srgb8_from_linear);
    rays.places()
        .map(|place| {
            let ray = rays.ray(place);
            let start = starts[rays.tile_index(place)];
            match method {
                ReconstructionMethod::LightFieldSearch { steps } => {
                    light_field_search::light_field_search(cameras, &ray, start, steps, background_srgb8)
                }
                ReconstructionMethod::JointCarve { stop_level } => {
                    joint_carve::joint_carve(cameras, &ray, start, stop_level, background_srgb8)
                }
                ReconstructionMethod::Mesh | ReconstructionMethod::HybridMesh { .. } => {
                    unreachable!("meshes are drawn, not searched")
                }
            }
        })
        .collect()
}

/// Twin of `background_pixels.wgsl`.
fn paint_background(pixels: &mut [Pixel], background: &Environment, rays: &ViewRays) {
    let without_surface =
        pixels.iter_mut().zip(rays.places()).filter(|(pixel, _)| pixel.provenance.kind() != ProvenanceKind::Hit);
    for (pixel, place) in without_surface.filter(|_| !background.is_uniform()) {
        let radiance = background.radiance_linear(rays.ray(place).direction.normalize_or_zero());
        pixel.srgb8 = radiance.to_array().map(srgb8_from_linear);
    }
}

/// Paints the background, fills unknown pixels, then adds highlights, which the fill would spread.
fn finished(
    mut pixels: Vec<Pixel>,
    images: &[DepthImage],
    set: &SetDescription<'_>,
    cameras: &[SampleCamera],
    rays: &ViewRays,
) -> View {
    paint_background(&mut pixels, &set.background, rays);
    fill::fill(&mut pixels, rays.size_px());
    specular::add_highlights(&mut pixels, images, set, cameras, rays);
    View {
        size_px: rays.size_px(),
        srgb8: pixels.iter().flat_map(|p| p.srgb8).collect(),
        inverse_depth_per_m: Some(pixels.iter().map(|p| p.inverse_depth_per_m).collect()),
        provenance: Some(pixels.iter().map(|p| p.provenance).collect()),
    }
}
