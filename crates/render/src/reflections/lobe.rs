//! Rays into the lobes of what a picture shows, pass by pass one of each pixel.

use bytemuck::{Pod, Zeroable};
use gpu::{Binding, ResourceTraits, ShaderVariant, switches};
use minijinja::{Value, context};
use wgpu::{Buffer, BufferUsages};

use super::bounces::BounceList;
use super::spawn::{self, VIEW_PLANES};
use crate::{RenderError, batch::Recording, pieces::Piece, pixel_camera::CAMERA_TRAITS, surfaces::Surfaces};

/// `Lobe` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLobe {
    pub first_ray: u32,
    pub ray: u32,
    pub ray_count: u32,
    pub whole: u32,
}

#[derive(Debug)]
pub(crate) struct Lobe {
    by_rays: bool,
    /// Planes of the picture, by which a pixel's place is found.
    plane_count: usize,
    /// The first ray of a pixel sums up the weights of all.
    first: bool,
}

impl ShaderVariant for Lobe {
    const TEMPLATE: &'static str = "reflections/lobe.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        context! { first => self.first, ..spawn::context(self.by_rays, self.plane_count) }
    }

    fn all() -> Vec<Self> {
        switches().map(|[by_rays, first]| Self { by_rays, plane_count: VIEW_PLANES, first }).collect()
    }
}

/// Records the pass over a piece of a picture.
pub(super) fn record(
    recording: &mut Recording<'_>,
    ray: u32,
    weights: &Buffer,
    piece: Piece,
    target: &Surfaces,
    next_bounces: &Buffer,
    next: &BounceList,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let variant = Lobe { by_rays: batch.by_rays, plane_count: batch.output.layout().count, first: ray == 0 };
    let pass = recording.passes.get(&variant)?;
    let whole = u32::from(batch.work.lighting.reflections.is_none());
    let ray_count = batch.glossy_rays();
    let first_ray = batch.position.number * ray_count;
    let lobe = GpuLobe { first_ray, ray: first_ray + ray, ray_count, whole };
    let lobe = recording.gpu.buffer_with("lobe", &[lobe], BufferUsages::UNIFORM);
    let buffers = [&recording.cameras, &batch.work.scene.illumination, &lobe, weights, next_bounces];
    let own = pass.bind(0, bindings(buffers, next, target))?;
    recording.dispatch_piece(recording.kind_of(&variant), &pass, &[&own], piece, piece.size());
    Ok(())
}

fn bindings<'r>(
    [camera, illumination, lobe, weights, next_bounces]: [&'r Buffer; 5],
    next: &'r BounceList,
    target: &'r Surfaces,
) -> Vec<Binding<'r>> {
    let mut bindings = spawn::bindings([camera, illumination, next_bounces], next, target);
    bindings.extend([Binding::buffer("lobe", lobe), Binding::buffer("weights", weights)]);
    bindings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::TestStage;

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let list = BounceList::new(&stage.gpu, 1);
        for variant in Lobe::all() {
            let target = stage.surfaces(variant.by_rays, false);
            stage.check(&variant, 0, &bindings([&stage.buffer; 5], &list, &target));
        }
    }
}
