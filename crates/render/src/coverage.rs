//! The pixels of sample images that images before them cover: non-redundant sampling for views whose light comes from samples.

use gpu::{Binding, ShaderVariant, switches};
use minijinja::{Value, context};

use crate::batch::Recording;
use crate::light_cache::Picture;
use crate::light_samples::{CoveredBy, LookUpTests, sample_texels};
use crate::{RenderError, sums::SumPlanes};

/// The stretched footprint of an image before, over an image's own, up to which it covers pixels.
pub const MOST_COARSER: f32 = 1.5;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Coverage {
    by_rays: bool,
    plane_count: usize,
    /// 0 where pixels have no light.
    sum_planes: usize,
}

impl ShaderVariant for Coverage {
    const TEMPLATE: &'static str = "coverage.wgsl";

    fn context(&self) -> Value {
        let Self { by_rays, plane_count, sum_planes } = *self;
        context! { by_rays, plane_count, sum_planes, single_pole => false, sample_texels => sample_texels(0) }
    }

    fn all() -> Vec<Self> {
        let lit = SumPlanes::all().map(SumPlanes::count);
        let all = lit.chain([0]).flat_map(|sum_planes| {
            switches().map(move |[by_rays, light]| Self { by_rays, plane_count: if light { 6 } else { 2 }, sum_planes })
        });
        all.collect()
    }
}

/// Records the coverage of one image. Pixels that keep their samples come in a list for each piece.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    covered_by: CoveredBy<'_>,
    picture: Picture<'_>,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    let Picture { camera, target, planes, lists, .. } = picture;
    let variant = Coverage {
        by_rays: batch.by_rays,
        plane_count: batch.output.layout().count,
        sum_planes: if batch.work.lighting.is_lit() { batch.output.sums.count() } else { 0 },
    };
    let before = covered_by.number(camera);
    let own = &batch.cameras[camera];
    let uniform = covered_by.surfaces.uniform(recording.gpu, batch.work.scene, LookUpTests::surrounded(), before, own);
    for (piece, list) in recording.pieces_of(camera).into_iter().zip(lists) {
        let own = [Binding::buffer("cache", &uniform), Binding::texture("samples", &covered_by.surfaces.samples)];
        let own = own.into_iter().chain(planes.bindings()).chain(target.bindings()).chain(list.bindings());
        let bound = recording.bind(&variant, (), own)?;
        recording.dispatch_piece(&bound, piece, piece.size());
    }
    Ok(())
}
