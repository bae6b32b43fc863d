//! The uniform of a view in passes over sample cameras: `view_work.wgsl`. A test compares layouts with the WGSL.

use bytemuck::{Pod, Zeroable};
use depth_image::PinholeCamera;
use glam::{UVec2, Vec3};
use gpu::{DynamicUniforms, GpuTone};
use minijinja::{Value, context};

/// Shaders name each camera; more would make them too long.
pub const MAX_SAMPLE_CAMERAS: usize = 16;
/// The sides of tiles; all rays of a tile start at one parameter.
pub(crate) const TILE_PX: u32 = 8;
/// Greater than every parameter and gap.
pub(crate) const FAR_AWAY: f32 = 3.0e38;
/// Positions in an image are kept this far from the border of the last cell.
pub(crate) const CELL_MARGIN_PX: f32 = 0.01;
/// Each dispatch sees one piece of a view of a batch.
pub(crate) const ONE_VIEW: DynamicUniforms = &["work"];

/// Switches of shaders that include `view_work.wgsl`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SetVariant {
    /// None of a set that is a layered cube alone.
    pub cameras: usize,
    /// Some texels of the set prove nothing of the space before them.
    pub holes: bool,
}

impl SetVariant {
    pub fn context(self) -> Value {
        context! { cameras => self.cameras, holes => self.holes }
    }

    /// A set of a layered cube alone.
    pub const CUBE: Self = Self { cameras: 0, holes: false };

    pub fn all() -> Vec<Self> {
        [1, 2, 4, MAX_SAMPLE_CAMERAS].map(|cameras| [false, true].map(|holes| Self { cameras, holes })).concat()
    }
}

/// `SampleCamera` of the shader.
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
    pub first_mip: u32,
}

/// `ViewCamera` of the shader.
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
    pub number: u32,
    /// The first row in the low half, and the row after the last in the high half: sides of views have less than 16 bits.
    pub rows: u32,
}

/// `ViewWork` of the shader, up to its cameras.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuViewWork {
    pub view: GpuViewCamera,
    pub volume: GpuVolume,
    pub tone: GpuTone,
}

/// The volume in `ViewWork`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuVolume {
    pub min_in_world: [f32; 3],
    pub position_share: f32,
    pub max_in_world: [f32; 3],
    pub padding: u32,
}

/// Columns and rows of tiles.
pub(crate) fn tiles_of(size_px: UVec2) -> UVec2 {
    size_px.map(|side| side.div_ceil(TILE_PX))
}

impl GpuViewCamera {
    /// The camera of the `number`-th view of a batch.
    pub fn of(camera: &PinholeCamera, number: u32) -> Self {
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
            first_tile: number * tiles_of(camera.size_px).element_product(),
            size_px: camera.size_px.to_array(),
            number,
            rows: camera.size_px.y << 16,
        }
    }
}
