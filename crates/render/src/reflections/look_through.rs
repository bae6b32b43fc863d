//! The rays of an eye through the glass that a picture shows.

use gpu::{ShaderVariant, switches};
use minijinja::Value;

use super::bounces::Rays;
use super::spawn::{self, VIEW_PLANES};
use crate::{RenderError, batch::Recording, pieces::Piece, surfaces::Surfaces};

/// The surfaces of glass that one ray goes through: what is seen through more is far away.
pub(crate) const MOST_INTERFACES: u32 = 16;

#[derive(Debug)]
pub(crate) struct LookThrough {
    by_rays: bool,
    /// Planes of the picture, by which a pixel's place is found.
    plane_count: usize,
}

impl ShaderVariant for LookThrough {
    const TEMPLATE: &'static str = "reflections/look_through.wgsl";

    fn context(&self) -> Value {
        spawn::context(self.by_rays, self.plane_count)
    }

    fn all() -> Vec<Self> {
        switches().map(|[by_rays]| Self { by_rays, plane_count: VIEW_PLANES }).collect()
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
    let variant = LookThrough { by_rays: batch.by_rays, plane_count: batch.output.layout().count };
    let bound = recording.bind(&variant, (), target.bindings().chain(next.next_bindings()))?;
    recording.dispatch_piece(&bound, piece, piece.size());
    Ok(())
}
