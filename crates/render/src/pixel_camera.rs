//! `PixelCamera` of `camera.wgsl`.

use bytemuck::{Pod, Zeroable};
use depth_image::Camera;
use glam::{Vec2, Vec3};
use gpu::{Gpu, uniform_elements};
use wgpu::BufferUsages;

/// One camera of a batch.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct PixelCamera {
    pub eye_in_world: [f32; 3],
    pub near_m: f32,
    pub column_in_world: [f32; 3],
    pub footprint: f32,
    pub row_in_world: [f32; 3],
    pub first_word: u32,
    pub corner_in_world: [f32; 3],
    pub first_sum: u32,
    pub size_px: [u32; 2],
    /// The first pixel, from where the forward axis meets the image; wraps.
    pub first_from_axis: [u32; 2],
    pub pixel_count: u32,
    pub seed: u32,
    pub first_shadow_ray: u32,
    pub shadow_rays: u32,
    pub first_ambient_ray: u32,
    pub ambient_rays: u32,
    pub shadow_rays_in_sum: u32,
    pub ambient_rays_in_sum: u32,
    pub occlusion_radius_m: f32,
    /// The rows of a dispatch.
    pub first_row: u32,
    pub end_row: u32,
    /// The lamps of a dispatch.
    pub first_light: u32,
    pub end_light: u32,
    /// Places of the grid on each lamp, along a side and all, and how far its rays are apart among them.
    pub grid_side: u32,
    pub grid_count: u32,
    pub grid_stride: u32,
    /// Pixels of the batch before the camera's.
    pub first_pixel: u32,
    /// Of a single-pole camera, as the two numbers that follow.
    pub bend_px_m: f32,
    pub pole_px: [f32; 2],
    pub farthest_m: f32,
    pub padding: [u32; 3],
}

impl PixelCamera {
    /// `camera` looks through a position within its pixels, this far from their centres.
    ///
    /// Rays' seeds are the camera's place, and the pixel's from the forward axis: noise does not swim while nothing moves,
    /// images that are blended do not share it, and a tile of an image has the image's. All positions within a pixel have its
    /// seed: they take different rays of one sequence.
    pub fn of(camera: &Camera, offset_px: Vec2) -> Self {
        let (pole_px, bend_px_m, farthest_m) = match camera {
            Camera::Pinhole(_) => Default::default(),
            Camera::SinglePole(camera) => (camera.pole_px.to_array(), camera.bend_px_m(), camera.farthest_m),
        };
        let camera = camera.reference();
        let column = camera.world_from_camera * Vec3::X / camera.focal_px.x;
        let row = camera.world_from_camera * Vec3::NEG_Y / camera.focal_px.y;
        let corner = camera.forward_in_world() - column * camera.principal_px.x - row * camera.principal_px.y;
        let eye = camera.eye_in_world.to_array().into_iter();
        let seed = eye.fold(0_u32, |seed, c| (seed ^ c.to_bits()).wrapping_mul(0x9e37_79b1).rotate_left(13));
        Self {
            eye_in_world: camera.eye_in_world.to_array(),
            near_m: camera.near_m,
            column_in_world: column.to_array(),
            footprint: camera.focal_px.min_element().recip(),
            row_in_world: row.to_array(),
            corner_in_world: corner.to_array(),
            size_px: camera.size_px.to_array(),
            pixel_count: camera.pixel_count() as u32,
            seed,
            first_from_axis: (-camera.principal_px - offset_px).floor().as_ivec2().as_uvec2().to_array(),
            shadow_rays_in_sum: 1,
            ambient_rays_in_sum: 1,
            end_row: camera.size_px.y,
            pole_px,
            bend_px_m,
            farthest_m,
            ..Self::zeroed()
        }
    }
}

/// A uniform of elements, each at its dynamic offset.
pub(crate) fn uniform<E: Pod>(gpu: &Gpu, label: &str, elements: impl Iterator<Item = E>) -> wgpu::Buffer {
    let elements: Vec<E> = elements.collect();
    gpu.buffer_with(label, &uniform_elements(elements.iter().map(bytemuck::bytes_of)), BufferUsages::UNIFORM)
}
