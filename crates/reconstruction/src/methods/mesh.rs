//! The conventional mesh: a quad between each four neighbouring samples of one surface.

use gpu::Frame;
use wgpu::BindingResource;

use crate::{
    ReconstructionError, Reconstructor, ShaderKey,
    quads::{ImageCut, buffers},
};

const WORKGROUP_PX: u32 = 8;

/// Cuts an image.
pub(crate) fn record(
    reconstructor: &Reconstructor,
    frame: &mut Frame<'_>,
    image: &ImageCut<'_>,
) -> Result<(), ReconstructionError> {
    let key = ShaderKey { name: "mesh.wgsl", ..ShaderKey::default() };
    let codes = BindingResource::TextureView(&image.set.cell_codes);
    let [depths, extents] = buffers([&image.quads.inverse_depths, &image.extents]);
    let [across, down] = image.size_px.to_array().map(|side| side.div_ceil(WORKGROUP_PX));
    reconstructor.cut_pass(frame, key, &image.work(), &[codes, depths, extents], [across, down, 1])
}
