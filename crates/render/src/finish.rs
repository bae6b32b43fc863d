//! Surface and light to finished planes: a view's colour and depth, or those of a depth image.

use std::collections::HashSet;

use depth_image::Highlight;
use gpu::{Binding, GpuEnvironment, PooledBuffer, ResourceTraits, ShaderVariant, highlight_name, switches};
use minijinja::{Value, context};
use wgpu::{Buffer, BufferUsages};

use crate::batch::{Batch, Recording};
use crate::planes::{Output, PlaneLayout};
use crate::{
    RenderError, pixel_camera::CAMERA_TRAITS, redundancy_test::RedundancyTest, sums::SumPlanes, surfaces::Surfaces,
};

#[derive(Debug)]
pub(crate) struct Finish {
    by_rays: bool,
    lit: bool,
    /// The environment is a map, which is the background, too.
    environment_map: bool,
    output: Output,
}

impl Finish {
    fn of(batch: &Batch<'_>) -> Self {
        let (lit, environment_map) = (batch.work.lighting.is_lit(), batch.work.scene.environment.is_some());
        Self { by_rays: batch.by_rays, lit, environment_map, output: batch.output }
    }

    /// The variants with each usefulness test.
    pub fn with_tests(tests: &[RedundancyTest]) -> impl Iterator<Item = Self> {
        let useful: HashSet<_> = tests.iter().filter_map(|test| test.usefulness).collect();
        useful.into_iter().flat_map(|test| Self::of_images(true, Some(test)))
    }

    fn of_images(passed: bool, usefulness_test: Option<&'static str>) -> impl Iterator<Item = Self> {
        switches().flat_map(move |[normal, reflector, surface_id]| {
            let planes = Output { samples: true, normal, reflector, surface_id, passed, ..Output::default() };
            Self::of_output(Output { usefulness_test, ..planes })
        })
    }

    fn of_output(output: Output) -> impl Iterator<Item = Self> {
        let each = move |sums| {
            let output = Output { sums, ..output };
            switches().map(move |[by_rays, lit, environment_map]| Self { by_rays, lit, environment_map, output })
        };
        SumPlanes::all().flat_map(each)
    }
}

impl ShaderVariant for Finish {
    const TEMPLATE: &'static str = "finish.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        let Output { sums, samples, highlight, passed: redundancy, usefulness_test, .. } = self.output;
        let PlaneLayout { normal, reflector, surface_id, passed, .. } = self.output.layout();
        context! {
            by_rays => self.by_rays,
            lit => self.lit,
            environment_map => self.environment_map,
            highlight => highlight.map(highlight_name),
            surface_id => surface_id.is_some(),
            normal_plane => normal, reflector_plane => reflector, id_plane => surface_id, passed_plane => passed,
            samples, redundancy, usefulness_test,
            ..sums.context()
        }
    }

    fn all() -> Vec<Self> {
        let highlights = [None, Some(Highlight::BlinnPhong), Some(Highlight::Ggx)].into_iter();
        let views = highlights.flat_map(|highlight| Self::of_output(Output { highlight, ..Output::default() }));
        views.chain(Self::of_images(false, None)).chain(Self::of_images(true, None)).collect()
    }
}

/// Records one dispatch for each camera; gives the words of all planes.
pub(crate) fn record(recording: &mut Recording<'_>, surfaces: &[Surfaces]) -> Result<PooledBuffer, RenderError> {
    let Recording { passes, gpu, pool, batch, .. } = recording;
    let bytes = batch.bytes(batch.output.layout().count);
    gpu.check_storage_bytes("the planes of a batch (bytes)", bytes)?;
    let words = pool.lend_storage("planes", bytes.max(4));
    let variant = Finish::of(batch);
    let pass = passes.get(&variant)?;
    let [r, g, b] = batch.work.scene.background_linear.to_array();
    let view_cell_m = batch.sequence.map_or(0.0, |sequence| sequence.known.view_cell_m);
    let finish = gpu.buffer_with("finish", &[r, g, b, view_cell_m], BufferUsages::UNIFORM);
    for (camera, target) in surfaces.iter().enumerate() {
        let Recording { batch, cameras, sums, .. } = recording;
        let buffers: [&Buffer; 5] = [cameras, &words, &sums.buffer, &finish, &batch.work.scene.illumination];
        let own = pass.bind(0, bindings(&variant, buffers, target, batch.work.scene.environment.as_deref()))?;
        recording.dispatch(&variant, &pass, &[&own], (camera, 1));
    }
    Ok(words)
}

fn bindings<'r>(
    variant: &Finish,
    [camera, words, sums, finish, illumination]: [&'r Buffer; 5],
    target: &'r Surfaces,
    map: Option<&'r GpuEnvironment>,
) -> Vec<Binding<'r>> {
    let mut bindings = vec![
        Binding::buffer("camera", camera),
        Binding::buffer("words", words),
        Binding::buffer("sums", sums),
        Binding::buffer("finish", finish),
    ];
    bindings.extend(target.bindings());
    bindings.extend(variant.output.highlight.map(|_| Binding::buffer("illumination", illumination)));
    let ids = target.surface_ids.as_ref().filter(|_| variant.output.surface_id);
    bindings.extend(ids.map(|ids| Binding::texture("surface_ids", ids)));
    bindings.extend(map.into_iter().flat_map(GpuEnvironment::bindings));
    bindings.extend(variant.output.passed.then(|| Binding::texture("front_depth", &target.views.front_depth)));
    bindings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::TestStage;

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        for variant in Finish::all() {
            let target = stage.surfaces(variant.by_rays, variant.output.surface_id);
            let map = variant.environment_map.then_some(&stage.environment);
            stage.check(&variant, 0, &bindings(&variant, [&stage.buffer; 5], &target, map));
        }
    }
}
