//! Rays into the lobes of what a picture shows, pass by pass one of each pixel.

use bytemuck::{Pod, Zeroable};
use gpu::{Binding, ShaderVariant, switches};
use minijinja::{Value, context};
use wgpu::{Buffer, BufferUsages};

use super::bounces::Rays;
use super::spawn::{self, VIEW_PLANES};
use crate::{RenderError, batch::Recording, pieces::Piece, surfaces::Surfaces};

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
    next: &Rays,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let variant = Lobe { by_rays: batch.by_rays, plane_count: batch.output.layout().count, first: ray == 0 };
    let whole = u32::from(batch.work.lighting.reflections.is_none());
    let ray_count = batch.glossy_rays();
    let first_ray = batch.position.number * ray_count;
    let lobe = GpuLobe { first_ray, ray: first_ray + ray, ray_count, whole };
    let lobe = recording.gpu.buffer_with("lobe", &[lobe], BufferUsages::UNIFORM);
    let own = [Binding::buffer("lobe", &lobe), Binding::buffer("weights", weights)];
    let own = own.into_iter().chain(next.next_bindings()).chain(target.bindings());
    let bound = recording.bind(&variant, (), own)?;
    recording.dispatch_piece(&bound, piece, piece.size());
    Ok(())
}
