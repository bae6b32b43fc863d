//! A layered depth cube on the device: its samples as bricks for rays to walk through, and as lines for their colours.

mod bricks;
mod light_field;
mod links;
mod reaches;
mod samples;

use depth_image::{CubeGrid, CubeImages, LayeredDepthImage};
use glam::Vec3;
use gpu::cube_walk::{CubeBricks, GpuCube};
use gpu::{Binding, GpuError, Table, TablePool, Turn};
use wgpu::TextureFormat;

pub(crate) use bricks::LEAST_NORMAL_ALONG_LINE;
pub(crate) use light_field::{FOOTPRINT_SHARE, GpuLightField, LEAST_LOBE_SHARE, LightField};
pub(crate) use light_field::{MOST_MASKING, NEAREST_SPACINGS};
pub(crate) use links::links;
pub(crate) use samples::{CubeSamples, Links};

use self::bricks::Bricks;
use crate::reflectors::{ReflectingPlanes, Reflectors};
use crate::{error::ReconstructionError, set_description::SetDescription};

/// Rays straight off a surface meet nothing below this height, in spacings, and slanting ones nothing within up to four times as much
/// of their way: samples of the surface itself may stand there.
const START_SPACINGS: f32 = 0.75;
/// Bits of an entry for a sample's number.
const MAX_SAMPLES: usize = 1 << 28;

/// A layered depth cube, ready to be walked through.
pub(crate) struct Cube {
    /// What rays are walked through.
    pub bricks: CubeBricks,
    /// What gives them colours.
    samples: Table,
    /// A ray straight off a surface meets nothing nearer.
    pub start_m: f32,
    /// Some line has met more surfaces than it holds.
    pub truncated: bool,
    pub reflectors: Option<Reflectors>,
    /// The light around the cube's mirrors.
    pub light_field: Option<LightField>,
}

impl Cube {
    /// Fails for images that are not those of the grid's lines, and beyond the device's limits.
    pub fn upload(
        tables: &TablePool,
        CubeImages { grid, images, light_field }: &CubeImages,
        set: &SetDescription<'_>,
        turn: Turn,
    ) -> Result<Self, ReconstructionError> {
        check(grid, images)?;
        let cells = grid.size.map(|side| side.div_ceil(8));
        let cell_count = cells.to_array().map(|side| side as usize).iter().product();
        tables.gpu.check_table("cells of a layered cube", cell_count)?;
        let count: usize = images.iter().map(LayeredDepthImage::sample_count).sum();
        GpuError::check_limit("the samples of a layered cube", count as u64, MAX_SAMPLES as u64)?;
        tables.gpu.check_table("samples of a layered cube", count)?;
        let samples = CubeSamples::of(grid, images);
        let bricks = Bricks::of(&samples);
        let words = samples.words(&links(&samples));
        let reflecting = images.each_ref().map(ReflectingPlanes::from);
        let start_m = START_SPACINGS * grid.spacing_m;
        let cube = GpuCube {
            cube_from_world: cube_from_world(grid),
            size: grid.size.to_array(),
            columns: cells.x,
            rows: cells.y,
            start_m,
            padding: [0; 2],
        };
        let texels = [
            tables.upload("cells of a cube", TextureFormat::R32Uint, &bricks.cells, turn)?,
            tables.upload("bricks of a cube", TextureFormat::Rgba32Uint, &bricks.bricks, turn)?,
            tables.upload("leaves of a cube", TextureFormat::Rgba32Uint, &bricks.leaves, turn)?,
            tables.upload("entries of a cube", TextureFormat::Rgba32Uint, &bricks.entries, turn)?,
        ];
        Ok(Self {
            bricks: CubeBricks::new(&tables.gpu, cube, texels),
            samples: tables.upload("samples of a cube", TextureFormat::Rgba32Uint, &words, turn)?,
            reflectors: Reflectors::upload(tables, &reflecting, Some(&samples.place), set, turn)?,
            start_m,
            light_field: light_field.as_ref().map(|field| LightField::upload(tables, field, turn)).transpose()?,
            truncated: images.iter().any(|image| image.truncated),
        })
    }

    /// The resources of passes that walk through it, show what its samples reflect, or gather in its light field.
    pub fn bindings(&self) -> Vec<Binding<'_>> {
        let mut bindings: Vec<_> = self.bricks.bindings().collect();
        bindings.push(Binding::texture("cube_samples", &self.samples));
        if let Some(field) = &self.light_field {
            bindings.push(Binding::buffer("light_field", &field.own));
            bindings.extend(field.tables.iter().map(|(name, table)| Binding::texture(name, table)));
        }
        bindings.extend(self.reflectors.iter().flat_map(Reflectors::bindings));
        bindings
    }
}

fn check(grid: &CubeGrid, images: &[LayeredDepthImage; 3]) -> Result<(), ReconstructionError> {
    grid.validate().map_err(|error| ReconstructionError::sample(0, error))?;
    for (index, image) in images.iter().enumerate() {
        image.validate().map_err(|error| ReconstructionError::sample(index, error))?;
        if !grid.has_camera(index, &image.camera) {
            let reason = format!("its lines are not those of the cube's grid along axis {index}");
            return Err(ReconstructionError::sample(index, reason));
        }
    }
    Ok(())
}

/// Rows that take a point of the world to the cube's space, in spacings from its corner.
fn cube_from_world(grid: &CubeGrid) -> [[f32; 4]; 3] {
    [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| {
        let row = grid.world_from_cube * axis / grid.spacing_m;
        row.extend(-row.dot(grid.corner_in_world)).to_array()
    })
}
