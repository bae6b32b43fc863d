//! Structs shared with the shaders; a test compares their layout with the WGSL.

use bytemuck::{Pod, Zeroable};
use depth_image::PinholeCamera;
use glam::{UVec2, Vec3};

/// `SampleCamera` of `sample_set.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuSampleCamera {
    pub homogeneous_pixel_from_world: [[f32; 4]; 3],
    pub eye_in_world: [f32; 3],
    pub code_scale: f32,
    pub cells: [f32; 2],
    pub code_offset: f32,
    pub focal_px: f32,
    pub log2_sides: [u32; 2],
    pub first_node: u32,
    pub first_cell: u32,
    pub width_px: u32,
    pub stretch: f32,
    pub mask: u32,
    pub padding: u32,
}

/// `ViewCamera` of `sample_set.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuViewCamera {
    pub eye_in_world: [f32; 3],
    pub near_m: f32,
    pub column_in_world: [f32; 3],
    pub focal_px: f32,
    pub row_in_world: [f32; 3],
    pub first_pixel: u32,
    pub corner_in_world: [f32; 3],
    pub first_tile: u32,
    pub size_px: [u32; 2],
    pub steps: u32,
    pub number: u32,
}

/// `ViewWork` of `sample_set.wgsl`, up to its cameras.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuViewWork {
    pub view: GpuViewCamera,
    pub volume: GpuVolume,
}

/// The volume in `ViewWork`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuVolume {
    pub min_in_world: [f32; 3],
    pub background_srgb8: u32,
    pub max_in_world: [f32; 3],
    pub padding: u32,
}

/// `FillWork` of `fill.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuFillWork {
    pub size_px: [u32; 2],
    pub first_pixel: u32,
    pub number: u32,
}

/// Indirect dispatch arguments and the length of a list; `Later` and `Hard` in the shaders.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuList {
    pub workgroups: [u32; 3],
    pub count: u32,
}

/// `CutWork` of `cut.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuCutWork {
    pub column_in_world: [f32; 3],
    pub focal_px: f32,
    pub row_in_world: [f32; 3],
    pub code_scale: f32,
    pub corner_in_world: [f32; 3],
    pub code_offset: f32,
    pub size_px: [u32; 2],
    pub first_sample: u32,
    pub first_corner: u32,
    pub axis: u32,
    pub bound_px: f32,
    pub chunks: u32,
    pub segment: u32,
}

/// `QuadWork` of `quads.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuQuadWork {
    pub clip_from_inverse_depth: [f32; 4],
    pub clip_from_column: [f32; 4],
    pub clip_from_row: [f32; 4],
    pub clip_from_corner: [f32; 4],
    pub width_px: u32,
    pub first_sample: u32,
    pub padding: [u32; 2],
}

impl GpuList {
    pub const EMPTY: Self = Self { workgroups: [0, 1, 1], count: 0 };
}

impl GpuViewCamera {
    /// Of the `number`-th view of a batch.
    pub fn of(camera: &PinholeCamera, number: u32, tiles: UVec2, steps: u32) -> Self {
        let column = camera.world_from_camera * Vec3::X / camera.focal_px.x;
        let row = camera.world_from_camera * Vec3::NEG_Y / camera.focal_px.y;
        let corner = camera.forward_in_world() - column * camera.principal_px.x - row * camera.principal_px.y;
        Self {
            eye_in_world: camera.eye_in_world.to_array(),
            near_m: camera.near_m,
            column_in_world: column.to_array(),
            focal_px: camera.focal_px.min_element(),
            row_in_world: row.to_array(),
            first_pixel: number * camera.size_px.element_product(),
            corner_in_world: corner.to_array(),
            first_tile: number * tiles.element_product(),
            size_px: camera.size_px.to_array(),
            steps,
            number,
        }
    }
}
