//! The light from the ends of followed rays, added to the pixels, and the rays off mirrors among those ends.

use depth_image::Highlight;
use gpu::{Binding, ShaderVariant, highlight_name, switches};
use minijinja::{Value, context};
use wgpu::Buffer;

use super::bounces::Rays;
use crate::{RenderError, batch::Recording, sums::SumPlanes};

#[derive(Debug)]
pub(crate) struct Land {
    /// Mirrors send rays on; else they show lamps and the environment.
    mirrors: bool,
    /// Rays that went through glass show the background.
    glass: bool,
    environment_map: bool,
    sums: SumPlanes,
}

impl ShaderVariant for Land {
    const TEMPLATE: &'static str = "reflections/land.wgsl";

    fn context(&self) -> Value {
        let Self { mirrors, glass, environment_map, sums } = *self;
        let highlight = highlight_name(Highlight::Ggx);
        context! { mirrors, glass, environment_map, highlight, lit => true, single_pole => false, ..sums.context() }
    }

    fn all() -> Vec<Self> {
        let sums = SumPlanes::all().filter(|sums| sums.visibility);
        let all = sums.flat_map(|sums| {
            switches().map(move |[mirrors, glass, environment_map]| Self { mirrors, glass, environment_map, sums })
        });
        all.collect()
    }
}

/// Records the pass over the rays off one mirror; those off the next are listed, if there is to be one.
pub(super) fn record(
    recording: &mut Recording<'_>,
    [camera, sums, reflected]: [&Buffer; 3],
    rays: &Rays,
    next: Option<&Rays>,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let environment_map = batch.work.scene.environment.is_some();
    let glass = batch.work.scene.has_glass();
    let variant = Land { mirrors: next.is_some(), glass, environment_map, sums: batch.output.sums };
    let buffers = [("camera", camera), ("sums", sums), ("reflected", reflected)];
    let own = buffers.into_iter().map(|(name, buffer)| Binding::buffer(name, buffer)).chain(rays.bindings());
    let own = own.chain(next.into_iter().flat_map(Rays::next_bindings));
    let bound = recording.bind(&variant, rays.generation, own)?;
    rays.dispatch(recording, &bound);
    Ok(())
}
