//! Rays off the mirrors that a picture shows.

use depth_image::Highlight;
use gpu::{ShaderVariant, highlight_name};
use minijinja::{Value, context, value::merge_maps};

use super::bounces::Rays;
use crate::{RenderError, batch::Recording, pieces::Piece, rays::Traversal, sums::SumPlanes, surfaces::Surfaces};

/// Planes of a view: colour and depth.
pub(super) const VIEW_PLANES: usize = 2;

#[derive(Debug)]
pub(crate) struct Spawn {
    by_rays: bool,
    /// Planes of the picture, by which a pixel's place is found.
    plane_count: usize,
    traversal: Traversal,
}

impl ShaderVariant for Spawn {
    const TEMPLATE: &'static str = "reflections/spawn.wgsl";

    fn context(&self) -> Value {
        merge_maps([context(self.by_rays, self.plane_count), self.traversal.context_of_mirrored_rays()])
    }

    fn all() -> Vec<Self> {
        [false, true]
            .into_iter()
            .flat_map(|by_rays| Traversal::ALL.map(|traversal| Self { by_rays, plane_count: VIEW_PLANES, traversal }))
            .collect()
    }
}

/// The values of shaders that list rays of a picture's pixels.
pub(super) fn context(by_rays: bool, plane_count: usize) -> Value {
    context! {
        single_pole => false, by_rays, plane_count,
        highlight => highlight_name(Highlight::Ggx), mirrors => true, environment_map => false,
        ..SumPlanes::default().context()
    }
}

/// Records the pass over a piece of a picture.
pub(super) fn record(
    recording: &mut Recording<'_>,
    piece: Piece,
    target: &Surfaces,
    next: &Rays,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let Some(traced) = batch.traced.as_deref() else { return Ok(()) };
    let plane_count = batch.output.layout().count;
    let variant = Spawn { by_rays: batch.by_rays, plane_count, traversal: traced.traversal };
    let bound = recording.bind(&variant, (), target.bindings().chain(next.next_bindings()))?;
    recording.dispatch_piece(&bound, piece, piece.size());
    Ok(())
}
