//! The scalar twin of every method: the same data, one pixel after another, in plain `f32`.
//!
//! An oracle for tests, written to be read beside the shaders; it is slow and takes only what
//! [`crate::Reconstructor::upload`] accepts.

mod curved_search;
mod draw;
mod fill;
mod follow;
mod gather;
mod hybrid_mesh;
mod joint_carve;
mod layered;
mod light_field_search;
mod march;
mod mesh;
mod mips;
mod pixel;
mod sample_camera;
mod smooth;
mod specular;
mod surface;
mod tile_start;
mod view_ray;

pub use self::curved_search::SinglePoleImages;
pub use self::follow::PinholeImages;
pub use self::gather::{Reflecting, gathered_light};
pub use self::layered::CubeTwin;
pub use self::mips::ColorMips;
use depth_image::{Aabb, Antialias, DepthImage, PinholeCamera, ToneMapping, View, ViewPlanes};
use glam::Vec3;

use self::view_ray::{ViewRays, places};
use self::{pixel::Pixel, sample_camera::SampleCamera, smooth::First};
use crate::{methods::ReconstructionMethod, pyramid::is_among_holes, quads::Quad, set_description::SetDescription};

/// One view with depth and provenance.
#[must_use]
pub fn reconstruct(
    images: &[DepthImage],
    set: &SetDescription<'_>,
    camera: &PinholeCamera,
    method: ReconstructionMethod,
) -> View {
    view(&pixels(images, set, camera, method), set, camera)
}

/// As [`reconstruct`], with the colour that the planes describe.
#[must_use]
pub fn reconstruct_shown(
    images: &[DepthImage],
    set: &SetDescription<'_>,
    camera: &PinholeCamera,
    method: ReconstructionMethod,
    ViewPlanes { antialias, tone, .. }: ViewPlanes,
) -> View {
    let sums = sums(images, set, camera, method, antialias);
    let srgb8 = sums.iter().flat_map(|sum| tone.srgb8(*sum / antialias.samples() as f32)).collect();
    View { srgb8, ..reconstruct(images, set, camera, method) }
}

/// Of each pixel, the linear light of all positions.
fn sums(
    images: &[DepthImage],
    set: &SetDescription<'_>,
    center: &PinholeCamera,
    method: ReconstructionMethod,
    antialias: Antialias,
) -> Vec<Vec3> {
    let mut cameras = antialias.offsets_px().map(|offset_px| center.with_offset(offset_px));
    let camera = cameras.next().unwrap_or(*center);
    let found = pixels(images, set, &camera, method);
    let mut sums = shown_linear(&found, set, &camera);
    let samples = nearest_first(images, &camera);
    let rays = ViewRays::of(&camera, &set.volume, images);
    let starts = tile_start::tile_starts(&samples, &rays);
    let first = First { pixels: &found, cameras: &samples, rays: &rays, starts: &starts, set, antialias };
    let shares = matches!(method, ReconstructionMethod::JointCarve { .. });
    let further = (0..found.len()).map(|index| if shares { first.further(index, sums[index]) } else { None });
    let further: Vec<Option<Vec3>> = further.collect();
    sums.iter_mut().zip(&further).for_each(|(sum, further)| *sum += further.unwrap_or_default());
    for camera in cameras {
        let shown = shown_linear(&rough(images, set, &camera, method, &found, &further), set, &camera);
        let own = sums.iter_mut().zip(shown).zip(&further).filter(|(_, further)| further.is_none());
        own.for_each(|((sum, shown), _)| *sum += shown);
    }
    sums
}

/// The pixels of a further position: only those that do not follow from the first are found.
fn rough(
    images: &[DepthImage],
    set: &SetDescription<'_>,
    camera: &PinholeCamera,
    method: ReconstructionMethod,
    first: &[Pixel],
    further: &[Option<Vec3>],
) -> Vec<Pixel> {
    if further.iter().all(Option::is_none) {
        return pixels(images, set, camera, method);
    }
    let samples = nearest_first(images, camera);
    let rays = ViewRays::of(camera, &set.volume, images);
    let mut found = pixels_from(&samples, &rays, &tile_start::tile_starts(&samples, &rays), method);
    let kept = found.iter_mut().zip(first).zip(further).filter(|(_, further)| further.is_some());
    kept.for_each(|((found, first), _)| *found = *first);
    finished(found, images, set, &samples, &rays)
}

fn pixels(
    images: &[DepthImage],
    set: &SetDescription<'_>,
    camera: &PinholeCamera,
    method: ReconstructionMethod,
) -> Vec<Pixel> {
    let cameras = nearest_first(images, camera);
    let rays = ViewRays::of(camera, &set.volume, images);
    let found = match quads(images, method) {
        Some(quads) => draw::drawn(&quads, images, &cameras, camera, &rays),
        None => pixels_from(&cameras, &rays, &tile_start::tile_starts(&cameras, &rays), method),
    };
    finished(found, images, set, &cameras, &rays)
}

/// What each pixel shows: its surface, or the background in its direction.
fn shown_linear(pixels: &[Pixel], set: &SetDescription<'_>, camera: &PinholeCamera) -> Vec<Vec3> {
    let shown = places(camera.size_px).zip(pixels).map(|(place, pixel)| {
        if pixel.inverse_depth_per_m > 0.0 {
            return pixel.color_linear;
        }
        let direction = camera.ray(place.as_vec2() + 0.5).direction_in_world;
        set.background.radiance_linear(direction.normalize_or_zero())
    });
    shown.collect()
}

fn view(pixels: &[Pixel], set: &SetDescription<'_>, camera: &PinholeCamera) -> View {
    View {
        size_px: camera.size_px,
        srgb8: shown_linear(pixels, set, camera).iter().flat_map(|&shown| ToneMapping::NONE.srgb8(shown)).collect(),
        inverse_depth_per_m: Some(pixels.iter().map(|p| p.inverse_depth_per_m).collect()),
        provenance: Some(pixels.iter().map(|p| p.provenance).collect()),
    }
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
    let found = pixels_from(&cameras, &rays, &starts, method);
    view(&finished(found, images, set, &cameras, &rays), set, camera)
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
    let images = images.iter().enumerate();
    match method {
        ReconstructionMethod::Mesh => Some(images.flat_map(|(number, image)| mesh::quads(number, image)).collect()),
        ReconstructionMethod::HybridMesh { merged } => {
            Some(images.flat_map(|(number, image)| hybrid_mesh::quads(number, image, merged)).collect())
        }
        _ => None,
    }
}

/// Camera 0 is the nearest to the view's eye and so knows most; each keeps its bit. Images that do not prove all ways
/// free come after those that do.
fn nearest_first(images: &[DepthImage], camera: &PinholeCamera) -> Vec<SampleCamera> {
    let among_holes = is_among_holes(images);
    let cameras = (0..).zip(images).map(|(bit, image)| SampleCamera::of(image, 1 << bit, among_holes));
    let mut cameras: Vec<_> = cameras.collect();
    cameras.sort_by(|a, b| {
        let [to_a, to_b] = [a, b].map(|c| c.eye_in_world.distance_squared(camera.eye_in_world));
        a.has_uncertain().cmp(&b.has_uncertain()).then(to_a.total_cmp(&to_b))
    });
    cameras
}

/// The pixels that the method finds, row by row.
fn pixels_from(cameras: &[SampleCamera], rays: &ViewRays, starts: &[f32], method: ReconstructionMethod) -> Vec<Pixel> {
    rays.places()
        .map(|place| {
            let ray = rays.ray(place);
            let start = starts[rays.tile_index(place)];
            match method {
                ReconstructionMethod::LightFieldSearch { steps } => {
                    light_field_search::light_field_search(cameras, &ray, start, steps)
                }
                ReconstructionMethod::JointCarve { stop_level } => {
                    joint_carve::joint_carve(cameras, &ray, start, stop_level)
                }
                ReconstructionMethod::Mesh
                | ReconstructionMethod::HybridMesh { .. }
                | ReconstructionMethod::Layered { .. }
                | ReconstructionMethod::LightCache { .. } => unreachable!("{method} searches no images along rays"),
            }
        })
        .collect()
}

/// Fills unknown pixels, then adds highlights, which the fill would spread.
fn finished(
    mut pixels: Vec<Pixel>,
    images: &[DepthImage],
    set: &SetDescription<'_>,
    cameras: &[SampleCamera],
    rays: &ViewRays,
) -> Vec<Pixel> {
    fill::fill(&mut pixels, rays.size_px());
    specular::add_highlights(&mut pixels, images, set, cameras, rays);
    pixels
}
