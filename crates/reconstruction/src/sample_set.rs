//! A sample set on the device.

use std::sync::Arc;

use bytemuck::Zeroable as _;
use depth_image::{Aabb, DepthImage, PinholeCamera};
use glam::{UVec2, Vec2, Vec3};
use gpu::cube_walk::CubeBricks;
use gpu::{Binding, GpuEnvironment, Table, TablePool, Turn};
use rayon::prelude::*;
use wgpu::{BufferUsages, TextureFormat};

use crate::bounce::mips::{mip_texels, mips};
use crate::cube::Cube;
use crate::pyramid::{CodedDepth, Pyramid, is_among_holes};
use crate::reflectors::{ReflectingPlanes, Reflectors};
use crate::single_pole::{GpuPole, poles};
use crate::view_work::{GpuSampleCamera, GpuVolume, MAX_SAMPLE_CAMERAS, SetVariant};
use crate::{error::ReconstructionError, quads::SetMeshes, set_description::SetDescription};

/// The padding of the volume, in parts of its longest edge. All cameras must still enter a surface on the very face of the
/// volume, although their samples of a slope are steps.
pub(crate) const VOLUME_MARGIN: f32 = 0.005;

/// One complete sample set: what views are reconstructed from.
pub struct SampleSet {
    pub(crate) cameras: Vec<GpuSampleCamera>,
    /// Images of which some texels prove nothing, by their bits in provenance.
    pub(crate) uncertain: Vec<bool>,
    pub(crate) volume: GpuVolume,
    /// Of images of single-pole cameras: one for each; else none.
    pub(crate) poles: Vec<GpuPole>,
    /// As `background.wgsl` reads it.
    pub(crate) background: wgpu::Buffer,
    /// Two words for each node of the pyramids.
    pub(crate) nodes: Table,
    /// See [`CodedDepth::cell_words`].
    pub(crate) cell_codes: Table,
    /// RGB9E5 of each texel and of the one below it; coarser levels follow those of all images.
    pub(crate) cell_colors: Table,
    pub(crate) reflectors: Option<Reflectors>,
    pub(crate) environment: Option<Arc<GpuEnvironment>>,
    pub(crate) meshes: SetMeshes,
    /// All surfaces of the scene, in place of images.
    pub(crate) cube: Option<Arc<Cube>>,
}

impl SampleSet {
    /// The switches of all shaders that read the set.
    pub(crate) fn variant(&self) -> SetVariant {
        SetVariant { cameras: self.cameras.len(), holes: self.uncertain.contains(&true) }
    }

    /// What rays are walked through in a layered cube; `None` for images.
    #[must_use]
    pub fn cube_bricks(&self) -> Option<&CubeBricks> {
        self.cube.as_ref().map(|cube| &cube.bricks)
    }

    /// The distance of a place from the volume that is searched.
    fn distance_m(&self, place_in_world: Vec3) -> f32 {
        let [min, max] = [self.volume.min_in_world, self.volume.max_in_world].map(Vec3::from);
        place_in_world.distance(place_in_world.clamp(min, max))
    }

    /// The tables of its images, and what these reflect.
    pub(crate) fn image_bindings(&self) -> Vec<Binding<'_>> {
        let mut bindings = vec![
            Binding::texture("nodes", &self.nodes),
            Binding::texture("cell_codes", &self.cell_codes),
            Binding::texture("cell_colors", &self.cell_colors),
        ];
        bindings.extend(self.reflectors.iter().flat_map(Reflectors::bindings));
        bindings
    }

    /// A set of images that were checked, of which there may be none.
    pub(crate) fn of_images(
        tables: &TablePool,
        images: &[DepthImage],
        set: &SetDescription<'_>,
        turn: Turn,
    ) -> Result<Self, ReconstructionError> {
        let poles = poles(images)?;
        let among_holes = is_among_holes(images);
        let coded = |image| CodedImage::of(image, among_holes, set.mips);
        // One thread leaves the other cores to live streams.
        let coded: Vec<CodedImage> = match tables.gpu.device_queue.cuts() {
            true => images.iter().map(coded).collect(),
            false => images.par_iter().map(coded).collect(),
        };
        let [mut nodes, mut codes] = [node_count(images), cell_count(images)].map(Vec::with_capacity);
        let mut colors: Vec<[u32; 2]> = Vec::with_capacity(color_count(images, set.mips));
        let mut cameras = Vec::with_capacity(images.len());
        let mut levels = Vec::with_capacity(images.len());
        let uncertain = coded.iter().map(|coded| coded.uncertain).collect();
        for (image, coded) in images.iter().zip(coded) {
            cameras.push(GpuSampleCamera {
                mask: 1 << cameras.len(),
                first_node: nodes.len() as u32,
                first_cell: codes.len() as u32,
                ..coded.camera
            });
            nodes.extend(coded.nodes);
            codes.extend(coded.cells);
            levels.push(coded.mips);
            colors.extend(with_below(&image.color_rgb9e5, image.size_px().x as usize));
        }
        for (camera, levels) in cameras.iter_mut().zip(levels).filter(|_| set.mips) {
            camera.first_mip = colors.len() as u32;
            levels.iter().for_each(|(size_px, level)| colors.extend(with_below(level, size_px.x as usize)));
        }
        // A table has one texel at least.
        for texels in [&mut nodes, &mut codes, &mut colors] {
            texels.resize(texels.len().max(1), [0; 2]);
        }
        let searched = searched_volume(&set.volume, images);
        let reflecting: Vec<ReflectingPlanes<'_>> = images.iter().map(ReflectingPlanes::from).collect();
        let background = gpu::background_bytes(&set.background);
        Ok(Self {
            cameras,
            uncertain,
            poles,
            volume: GpuVolume {
                min_in_world: searched.min.to_array(),
                max_in_world: searched.max.to_array(),
                ..GpuVolume::zeroed()
            },
            background: tables.gpu.buffer_with("background", &background, BufferUsages::UNIFORM),
            nodes: tables.upload("depth pyramids", TextureFormat::Rg32Uint, &nodes, turn)?,
            cell_codes: tables.upload("cells", TextureFormat::Rg32Uint, &codes, turn)?,
            cell_colors: tables.upload("sample colours", TextureFormat::Rg32Uint, &colors, turn)?,
            reflectors: Reflectors::upload(tables, &reflecting, None, set, turn)?,
            environment: set.environment.cloned(),
            meshes: SetMeshes::upload(tables, images, turn)?,
            cube: None,
        })
    }
}

/// The numbers of blocks, nearest first. Blocks are the cells of one grid: no ray comes to a nearer one after a farther one.
pub(crate) fn front_to_back(blocks: &[&SampleSet], camera: &PinholeCamera) -> Vec<usize> {
    let distances: Vec<f32> = blocks.iter().map(|block| block.distance_m(camera.eye_in_world)).collect();
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    order.sort_by(|&a, &b| distances[a].total_cmp(&distances[b]));
    order
}

/// One image, as shaders see it.
struct CodedImage {
    uncertain: bool,
    /// Without its place in the set.
    camera: GpuSampleCamera,
    nodes: Vec<[u32; 2]>,
    cells: Vec<[u32; 2]>,
    /// The coarser levels of its colours.
    mips: Vec<(UVec2, Vec<u32>)>,
}

impl CodedImage {
    fn of(image: &DepthImage, among_holes: bool, with_mips: bool) -> Self {
        let depth = CodedDepth::in_set(image, among_holes);
        let pyramid = Pyramid::of(&depth);
        let camera = image.camera.reference();
        let gpu_camera = GpuSampleCamera {
            homogeneous_pixel_from_world: camera.homogeneous_pixel_from_world().map(|row| row.to_array()),
            eye_in_world: camera.eye_in_world.to_array(),
            code_scale: depth.scale,
            cells: (camera.size_px.as_vec2() - 1.0).to_array(),
            code_offset: depth.offset,
            focal_px: camera.focal_px.min_element(),
            log2_sides: pyramid.log2_sides,
            width_px: camera.size_px.x,
            stretch: stretch(camera),
            ..GpuSampleCamera::zeroed()
        };
        Self {
            uncertain: !depth.uncertain.is_empty(),
            camera: gpu_camera,
            nodes: pyramid.words.iter().zip(pyramid.wide_words()).map(|(&range, wide)| [range, wide]).collect(),
            cells: depth.cell_words(),
            mips: if with_mips { mips(image) } else { Vec::new() },
        }
    }
}

pub(crate) fn check(
    tables: &TablePool,
    images: &[DepthImage],
    set: &SetDescription<'_>,
) -> Result<(), ReconstructionError> {
    if images.is_empty() || images.len() > MAX_SAMPLE_CAMERAS {
        return Err(ReconstructionError::SampleCount(images.len()));
    }
    check_volume(&set.volume)?;
    for (index, image) in images.iter().enumerate() {
        image.camera.validate().map_err(|error| ReconstructionError::sample(index, error))?;
        image.validate().map_err(|error| ReconstructionError::sample(index, error))?;
        if image.light.is_some() {
            return Err(ReconstructionError::LightForColor { index });
        }
        if image.size_px().min_element() < 2 {
            let reason = "an image of one row or column has no surface between samples";
            return Err(ReconstructionError::sample(index, reason));
        }
    }
    tables.gpu.check_table("depth pyramids", node_count(images))?;
    tables.gpu.check_table("cells", cell_count(images))?;
    tables.gpu.check_table("sample colours", color_count(images, set.mips))?;
    Ok(())
}

pub(crate) fn check_volume(volume: &Aabb) -> Result<(), ReconstructionError> {
    if volume.is_empty() || !volume.size().is_finite() { Err(ReconstructionError::Volume) } else { Ok(()) }
}

/// Each texel's colour and that of the texel below it. The last row is below itself.
fn with_below(colors: &[u32], columns: usize) -> impl Iterator<Item = [u32; 2]> {
    let last = &colors[colors.len() - columns..];
    colors.iter().zip(colors[columns..].iter().chain(last)).map(|(&own, &below)| [own, below])
}

fn node_count(images: &[DepthImage]) -> usize {
    images.iter().map(|image| Pyramid::word_count(Pyramid::log2_sides(image.size_px().to_array()))).sum()
}

/// One cell a texel.
fn cell_count(images: &[DepthImage]) -> usize {
    images.iter().map(|image| image.color_rgb9e5.len()).sum()
}

/// One colour a texel, and those of coarser levels.
fn color_count(images: &[DepthImage], with_mips: bool) -> usize {
    let coarser = if with_mips { images.iter().map(|image| mip_texels(image.size_px())).sum() } else { 0 };
    cell_count(images) + coarser
}

/// `f √(1 + slope²)` at the corner farthest off the axis: a point that moves by r moves in the image by
/// at most this times r / depth.
pub(crate) fn stretch(camera: &PinholeCamera) -> f32 {
    let corners =
        [Vec2::ZERO, camera.size_px.as_vec2()].map(|corner| ((corner - camera.principal_px) / camera.focal_px).abs());
    let slope = corners[0].max(corners[1]);
    camera.focal_px.max_element() * (1.0 + slope.length_squared()).sqrt()
}

/// The volume with room for the error of samples: a search must still be inside where it meets a surface on the volume's
/// very face.
pub(crate) fn searched_volume(volume: &Aabb, images: &[DepthImage]) -> Aabb {
    let among_holes = is_among_holes(images);
    let depth_error_m = images.iter().map(|image| CodedDepth::greatest_error_m(image, among_holes)).fold(0.0, f32::max);
    volume.padded(volume.size().max_element() * VOLUME_MARGIN + depth_error_m)
}
