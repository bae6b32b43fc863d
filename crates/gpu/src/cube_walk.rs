//! The samples of a layered depth cube, as `cube_walk.wgsl` walks through them.

use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages;

use crate::{Binding, Gpu, Table};

/// A ray steps this far into the next box, in spacings: more than the rounding of coordinates within the largest cube.
pub(crate) const WALK_NUDGE: f32 = 2e-3;
/// A surface that is met so far outside of its voxel counts, in spacings.
pub(crate) const HIT_SLACK: f32 = 0.1;
/// Steps of a ray, of which each crosses a voxel or empty cells.
pub(crate) const MAX_CUBE_STEPS: u32 = 8192;
/// The side of a voxel, in spacings.
pub const VOXEL: f32 = 2.0;
/// Samples reach a little over the middle between two lines, in spacings: no ray passes between two squares.
pub const SQUARE_REACH: f32 = 0.55;
/// Planes reach no farther from their sample along the line, in spacings: `SQUARE_REACH` times the greatest sum of both slopes.
pub const MOST_REACH: f32 = 1.4;
/// An entry's depth is counted from this far below its voxel, in spacings.
pub const ENTRY_DEPTH_BELOW: f32 = MOST_REACH;
/// The step of an entry's depth, in spacings.
pub const ENTRY_DEPTH_STEP: f32 = (2.0 * MOST_REACH + VOXEL) / 16383.0;
/// Of an entry that is the first of its leaf: more than one other follows.
pub const MORE_ENTRIES: u32 = 1 << 31;

/// `Cube` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "the shader says what its fields are")]
pub struct GpuCube {
    pub cube_from_world: [[f32; 4]; 3],
    pub size: [u32; 3],
    pub columns: u32,
    pub rows: u32,
    pub start_m: f32,
    pub padding: [u32; 2],
}

/// A cube's samples on the device, in bricks that rays are walked through.
pub struct CubeBricks {
    own: wgpu::Buffer,
    /// Tables with their names in shaders.
    tables: [(&'static str, Table); 4],
}

impl CubeBricks {
    /// The tables are those of cells, bricks, leaves and entries.
    #[must_use]
    pub fn new(gpu: &Gpu, cube: GpuCube, [cells, bricks, leaves, entries]: [Table; 4]) -> Self {
        Self {
            own: gpu.buffer_with("cube", &[cube], BufferUsages::UNIFORM),
            tables: [
                ("cube_cells", cells),
                ("cube_bricks", bricks),
                ("cube_leaves", leaves),
                ("cube_entries", entries),
            ],
        }
    }

    /// The resources of passes that walk rays.
    pub fn bindings(&self) -> impl Iterator<Item = Binding<'_>> {
        let tables = self.tables.iter().map(|(name, table)| Binding::texture(name, table));
        [Binding::buffer("cube", &self.own)].into_iter().chain(tables)
    }
}
