//! Surfaces by one ray a pixel.

use std::sync::Arc;

use depth_image::Highlight;
use gpu::{Binding, Frame, Gpu, PassCache, ResourceTraits, ShaderVariant, Templates, highlight_name, switches};
use minijinja::{Value, context, value::merge_maps};

use super::{ray_scene::Traced, traversal::Traversal};
use crate::{
    RenderError, image_sequence::Predecessors, known_samples::RedundancyVariant, pixel_camera::CAMERA_TRAITS,
    redundancy_test::RedundancyTest, surfaces::Surfaces,
};

/// The redundant surfaces that one ray passes before it is given up: the software device ends long loops.
pub const MOST_LAYERS: u32 = 64;
/// The group of known samples.
const KNOWN_GROUP: u32 = 2;

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct PrimaryVariant {
    traversal: Traversal,
    /// `None` shows colours as they are.
    shading: Option<Highlight>,
    surface_id: bool,
    count_visits: bool,
    redundancy: Option<RedundancyVariant>,
}

impl PrimaryVariant {
    /// The variants with each redundancy test.
    pub fn with_tests(tests: &[RedundancyTest]) -> impl Iterator<Item = Self> {
        let each =
            |redundancy| Self::all().into_iter().map(move |variant| Self { redundancy: Some(redundancy), ..variant });
        RedundancyVariant::all(tests).into_iter().flat_map(each)
    }
}

impl ShaderVariant for PrimaryVariant {
    const TEMPLATE: &'static str = "rays/primary.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        context! {
            primary => true,
            shading => self.shading.map_or("unlit", highlight_name),
            surface_id => self.surface_id,
            count_visits => self.count_visits,
            ..merge_maps([self.traversal.context(), RedundancyVariant::context(self.redundancy, KNOWN_GROUP)])
        }
    }

    fn all() -> Vec<Self> {
        let shadings = [None, Some(Highlight::BlinnPhong), Some(Highlight::Ggx)];
        let each = |shading| {
            switches().flat_map(move |[surface_id, count_visits]| {
                Traversal::ALL.map(|traversal| Self { traversal, shading, surface_id, count_visits, redundancy: None })
            })
        };
        shadings.into_iter().flat_map(each).collect()
    }
}

/// The surfaces that are looked for.
#[derive(Clone, Copy)]
pub(crate) struct PrimaryWork<'a> {
    pub traced: &'a Traced,
    pub shading: Option<Highlight>,
    pub surface_id: bool,
    pub cameras: &'a wgpu::Buffer,
    /// The place of the first of the surfaces' cameras.
    pub first: u32,
    /// Receives node visits and triangle tests of each pixel, of a single camera.
    pub visit_counts: Option<&'a wgpu::Buffer>,
    /// The images whose samples are not shown again, of a single camera.
    pub predecessors: Option<Predecessors<'a>>,
}

pub(crate) struct Primary {
    gpu: Arc<Gpu>,
    passes: PassCache,
}

impl Primary {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { gpu: gpu.clone(), passes: PassCache::new(gpu, templates) }
    }

    /// Records one dispatch for each camera into its own textures.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        work: PrimaryWork<'_>,
        surfaces: &[Surfaces],
    ) -> Result<(), RenderError> {
        let pass = self.passes.get(&PrimaryVariant {
            traversal: Traversal::of(work.traced),
            shading: work.shading,
            surface_id: work.surface_id,
            count_visits: work.visit_counts.is_some(),
            redundancy: work.predecessors.map(Predecessors::variant),
        })?;
        let rays = pass.bind(1, work.traced.bindings())?;
        let bind = |bindings: Vec<Binding<'_>>| pass.bind(KNOWN_GROUP, bindings);
        let known = work.predecessors.map(|images| images.bind(&self.gpu, bind)).transpose()?;
        for (element, target) in (work.first..).zip(surfaces) {
            let own = pass.bind(0, bindings(&work, target))?;
            let groups: Vec<_> = [&own, &rays].into_iter().chain(&known).collect();
            pass.dispatch_each(frame, &groups, element..element + 1, target.invocations(1));
        }
        Ok(())
    }
}

fn bindings<'r>(work: &PrimaryWork<'r>, target: &'r Surfaces) -> Vec<Binding<'r>> {
    let mut bindings = vec![Binding::buffer("camera", work.cameras)];
    bindings.extend(target.bindings());
    let ids = target.surface_ids().filter(|_| work.surface_id);
    bindings.extend(ids.map(|ids| Binding::texture("surface_ids", ids)));
    bindings.extend(work.predecessors.map(|_| Binding::texture("front_depth", target.front_depth())));
    bindings.extend(work.visit_counts.map(|counts| Binding::buffer("visit_counts", counts)));
    bindings
}

#[cfg(test)]
mod tests {
    use depth_image::PinholeCamera;
    use glam::{UVec2, Vec3};
    use gpu::ShaderError;

    use super::*;
    use crate::{
        image_sequence::ImageSequence,
        known_samples::{KnownSamples, LayerCache},
        test_support::{TEST, TestStage},
    };

    fn check(stage: &TestStage, traced: &Traced, predecessors: Option<Predecessors<'_>>, variant: &PrimaryVariant) {
        let target = stage.surfaces(true, variant.surface_id);
        let visit_counts = variant.count_visits.then_some(&stage.buffer);
        let (shading, surface_id, cameras) = (variant.shading, variant.surface_id, &stage.buffer);
        let work = PrimaryWork { traced, shading, surface_id, cameras, first: 0, visit_counts, predecessors };
        stage.check(variant, 0, &bindings(&work, &target));
        stage.check(variant, 1, &traced.bindings());
    }

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let traced = stage.scene.rays.at(0.0).expect("a tree");
        let camera = PinholeCamera::looking_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 0.8, UVec2::ONE);
        let known = || KnownSamples::of(&stage.gpu, &LayerCache::default(), &[camera; 2], TEST).expect("known samples");
        let reference = known().into_reference();
        for known in [known(), known().after(Some(&reference))] {
            let sequence = ImageSequence { known: &known, wanted: &[0, 1], first: 0, keeps: true };
            let images = sequence.predecessors(1, &camera).expect("an image before");
            for variant in PrimaryVariant::all() {
                check(&stage, &traced, None, &variant);
                let variant = PrimaryVariant { redundancy: Some(images.variant()), ..variant };
                check(&stage, &traced, Some(images), &variant);
                let mut count = 0;
                let _ = images.bind(&stage.gpu, |bindings| {
                    count = bindings.len();
                    stage.check(&variant, KNOWN_GROUP, &bindings);
                    Err(ShaderError::Invalid { shader: String::new(), message: "checked".to_owned() })
                });
                assert!(count >= 2);
            }
        }
    }
}
