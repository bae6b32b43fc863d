//! Surface and light to finished planes: a view's colour and depth, or those of a depth image.

use std::{collections::HashSet, sync::Arc};

use depth_image::Highlight;
use gpu::{Binding, Frame, Gpu, PassCache, ResourceTraits, ShaderVariant, Templates, highlight_name, switches};
use minijinja::{Value, context};
use wgpu::BufferUsages;

use crate::{
    GpuScene, RenderError, pixel_camera::CAMERA_TRAITS, planes::PlaneLayout, redundancy_test::RedundancyTest,
    sums::SumPlanes, surfaces::Surfaces,
};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct FinishVariant {
    pub by_rays: bool,
    pub lit: bool,
    pub sums: SumPlanes,
    pub output: Output,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Output {
    /// A view, with highlights for its own eye.
    View {
        highlight: Option<Highlight>,
    },
    DepthImage {
        normal: bool,
        reflector: bool,
        surface_id: bool,
        redundancy: Redundancy,
    },
}

/// The tests that samples of depth images have passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Redundancy {
    None,
    Tested,
    /// Samples behind redundant ones must pass the template's test, too.
    TestedUseful(&'static str),
}

impl Redundancy {
    pub fn of(test: RedundancyTest) -> Self {
        test.usefulness.map_or(Self::Tested, Self::TestedUseful)
    }

    fn usefulness(self) -> Option<&'static str> {
        match self {
            Self::None | Self::Tested => None,
            Self::TestedUseful(template) => Some(template),
        }
    }
}

impl FinishVariant {
    /// The variants with each usefulness test.
    pub fn with_tests(tests: &[RedundancyTest]) -> impl Iterator<Item = Self> {
        let useful: HashSet<_> = tests.iter().filter_map(|test| test.usefulness).collect();
        useful.into_iter().flat_map(|test| Output::images(Redundancy::TestedUseful(test))).flat_map(Self::of_output)
    }

    fn of_output(output: Output) -> impl Iterator<Item = Self> {
        let each = move |sums| switches().map(move |[by_rays, lit]| Self { by_rays, lit, sums, output });
        SumPlanes::all().flat_map(each)
    }

    /// The places of planes among those of a camera.
    pub fn layout(&self) -> PlaneLayout {
        let Output::DepthImage { normal, reflector, surface_id, redundancy } = self.output else {
            return PlaneLayout { count: 2, ..PlaneLayout::default() };
        };
        let visibility_words = self.sums.visibility_words();
        let mut count = 2;
        let mut place = |is: bool, planes: usize| {
            let first = is.then_some(count);
            count += if is { planes } else { 0 };
            first
        };
        let normal = place(normal, 1);
        let reflector = place(reflector, 1 + visibility_words);
        let surface_id = place(surface_id, 2);
        let passed = place(redundancy != Redundancy::None, 1);
        PlaneLayout { normal, reflector, visibility_words, surface_id, passed, count }
    }

    fn highlight(&self) -> Option<Highlight> {
        match self.output {
            Output::View { highlight } => highlight,
            Output::DepthImage { .. } => None,
        }
    }

    fn redundancy(&self) -> Redundancy {
        match self.output {
            Output::View { .. } => Redundancy::None,
            Output::DepthImage { redundancy, .. } => redundancy,
        }
    }
}

impl Output {
    fn views() -> [Self; 3] {
        [None, Some(Highlight::BlinnPhong), Some(Highlight::Ggx)].map(|highlight| Self::View { highlight })
    }

    fn images(redundancy: Redundancy) -> impl Iterator<Item = Self> {
        switches().map(move |[normal, reflector, surface_id]| Self::DepthImage {
            normal,
            reflector,
            surface_id,
            redundancy,
        })
    }
}

impl ShaderVariant for FinishVariant {
    const TEMPLATE: &'static str = "finish.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        let PlaneLayout { normal, reflector, surface_id, passed, .. } = self.layout();
        context! {
            by_rays => self.by_rays,
            lit => self.lit,
            samples => matches!(self.output, Output::DepthImage { .. }),
            highlight => self.highlight().map(highlight_name),
            surface_id => surface_id.is_some(),
            redundancy => self.redundancy() != Redundancy::None,
            usefulness_test => self.redundancy().usefulness(),
            normal_plane => normal, reflector_plane => reflector, id_plane => surface_id, passed_plane => passed,
            ..self.sums.context()
        }
    }

    fn all() -> Vec<Self> {
        let images = [Redundancy::None, Redundancy::Tested].into_iter().flat_map(Output::images);
        Output::views().into_iter().chain(images).flat_map(Self::of_output).collect()
    }
}

/// The inputs of finished planes.
#[derive(Clone, Copy)]
pub(crate) struct FinishWork<'a> {
    pub variant: FinishVariant,
    pub scene: &'a GpuScene,
    /// The greatest distance between viewpoints of the set.
    pub view_cell_m: f32,
    pub cameras: &'a wgpu::Buffer,
    pub sums: &'a wgpu::Buffer,
    pub words: &'a wgpu::Buffer,
}

pub(crate) struct Finish {
    gpu: Arc<Gpu>,
    passes: PassCache,
}

impl Finish {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { gpu: gpu.clone(), passes: PassCache::new(gpu, templates) }
    }

    /// Records one dispatch for each camera.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        work: FinishWork<'_>,
        surfaces: &[Surfaces],
    ) -> Result<(), RenderError> {
        let pass = self.passes.get(&work.variant)?;
        let [r, g, b] = work.scene.background_linear.to_array();
        let finish = self.gpu.buffer_with("finish", &[r, g, b, work.view_cell_m], BufferUsages::UNIFORM);
        for (element, target) in (0..).zip(surfaces) {
            let own = pass.bind(0, bindings(&work, &finish, target))?;
            pass.dispatch_each(frame, &[&own], element..element + 1, target.invocations(1));
        }
        Ok(())
    }
}

fn bindings<'r>(work: &FinishWork<'r>, finish: &'r wgpu::Buffer, target: &'r Surfaces) -> Vec<Binding<'r>> {
    let layout = work.variant.layout();
    let mut bindings = vec![
        Binding::buffer("camera", work.cameras),
        Binding::buffer("words", work.words),
        Binding::buffer("sums", work.sums),
        Binding::buffer("finish", finish),
    ];
    bindings.extend(target.bindings());
    bindings.extend(work.variant.highlight().map(|_| Binding::buffer("illumination", &work.scene.illumination)));
    let ids = target.surface_ids().filter(|_| layout.surface_id.is_some());
    bindings.extend(ids.map(|ids| Binding::texture("surface_ids", ids)));
    bindings.extend(layout.passed.map(|_| Binding::texture("front_depth", target.front_depth())));
    bindings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::TestStage;

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let TestStage { scene, buffer, .. } = &stage;
        for variant in FinishVariant::all() {
            let target = stage.surfaces(variant.by_rays, variant.layout().surface_id.is_some());
            let work = FinishWork { variant, scene, view_cell_m: 0.0, cameras: buffer, sums: buffer, words: buffer };
            stage.check(&variant, 0, &bindings(&work, buffer, &target));
        }
    }
}
