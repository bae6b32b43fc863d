//! Xie's hybrid reconstruction: each sample a quad of its texel, corners shared with its neighbours, and rectangles
//! of them merged where a surface is flat.

use depth_image::{DepthImage, HOLE_INVERSE_DEPTH};
use glam::UVec2;
use gpu::Frame;
use wgpu::BindingResource;

use crate::{
    ErrorBound, ReconstructionError, Reconstructor, RequiredPlanes, ShaderKey,
    layout::GpuCutWork,
    quads::{ImageCut, buffers},
    word_texture::{self, WordTexture, WordTextures},
};

const WORKGROUP_PX: u32 = 8;
const WORKGROUP_LINES: u32 = 64;
/// The greatest merged quad, across and down in texels: lines are merged in pieces so long. Powers of two; more would be
/// too much for one thread of the software device, which ends loops after 65,535 turns.
pub(crate) const GREATEST_EXTENT: UVec2 = UVec2::new(64, 16);

/// What corners of quads are made from, on the device: see `planes` in `hybrid_mesh.wgsl`.
pub(crate) struct CornerPlanes {
    texels: WordTexture,
    /// Of each image its first texel.
    pub first_corners: Vec<u32>,
}

pub(crate) const REQUIRED_PLANES: RequiredPlanes = RequiredPlanes { normal: true, corner_inverse_depth: true };

pub(super) fn parse_bound(text: &str) -> Option<ErrorBound> {
    text.parse().ok().and_then(ErrorBound::from_px)
}

impl CornerPlanes {
    /// Of images that have all planes.
    pub fn upload(textures: &WordTextures, images: &[DepthImage]) -> Result<Self, ReconstructionError> {
        let count = images.iter().map(|image| (image.size_px() + 1).element_product() as usize).sum();
        textures.check("corners", count)?;
        let mut texels = word_texture::room(count);
        let mut first_corners = Vec::with_capacity(images.len());
        for image in images {
            first_corners.push(texels.len() as u32);
            texels.extend(corner_texels(image));
        }
        Ok(Self { texels: textures.upload("corners", texels)?, first_corners })
    }
}

/// Of each corner, row by row, the sample to its lower right and its own depth.
fn corner_texels(image: &DepthImage) -> impl Iterator<Item = [u32; 4]> {
    let size_px = image.size_px();
    let normals = image.normal_oct16.as_deref().unwrap_or_default();
    let corners = image.corner_inverse_depth_per_m.as_deref().unwrap_or_default();
    let places = (0..=size_px.y).flat_map(move |y| (0..=size_px.x).map(move |x| (x, y)));
    places.zip(corners).map(move |((x, y), corner)| {
        let sample = (x < size_px.x && y < size_px.y).then_some((y * size_px.x + x) as usize);
        let inverse_depth = sample.map_or(HOLE_INVERSE_DEPTH, |sample| image.inverse_depth_per_m[sample]);
        let normal = sample.and_then(|sample| normals.get(sample)).copied().unwrap_or_default();
        [inverse_depth.to_bits(), normal, corner.to_bits(), 0]
    })
}

/// Cuts an image, and merges what is flat within the bound.
pub(crate) fn record(
    reconstructor: &Reconstructor,
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    merged: Option<ErrorBound>,
) -> Result<(), ReconstructionError> {
    let planes = image.set.meshes.planes.as_ref();
    let planes = planes.map_err(|&(index, plane)| ReconstructionError::MissingPlane { index, plane })?;
    let key = ShaderKey { name: "hybrid_mesh.wgsl", hybrid: true, ..ShaderKey::default() };
    let texels = BindingResource::TextureView(&planes.texels);
    let [depths, extents] = buffers([&image.quads.inverse_depths, &image.extents]);
    let groups = image.size_px.to_array().map(|side| side.div_ceil(WORKGROUP_PX));
    let work = image.work();
    reconstructor.cut_pass(frame, key, &work, &[texels, depths, extents], [groups[0], groups[1], 1])?;
    merged.map_or(Ok(()), |bound| merge(reconstructor, frame, image, bound))
}

/// Rows into runs, then columns of equal runs into rectangles.
fn merge(
    reconstructor: &Reconstructor,
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
    bound: ErrorBound,
) -> Result<(), ReconstructionError> {
    let key = ShaderKey { name: "merge.wgsl", hybrid: true, ..ShaderKey::default() };
    for (axis, segment) in (0..).zip(GREATEST_EXTENT.to_array()) {
        let [length, lines] = [axis, 1 - axis].map(|axis| image.size_px[axis]);
        let work = GpuCutWork { axis: axis as u32, segment, bound_px: bound.px(), ..image.work() };
        let used = buffers([&image.quads.inverse_depths, &image.extents, &image.report]);
        reconstructor.cut_pass(
            frame,
            key,
            &work,
            &used,
            [lines.div_ceil(WORKGROUP_LINES), length.div_ceil(segment), 1],
        )?;
    }
    Ok(())
}
