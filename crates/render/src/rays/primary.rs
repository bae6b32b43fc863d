//! Surfaces by one ray a pixel.

use depth_image::Highlight;
use gpu::{Binding, ResourceTraits, ShaderVariant, highlight_name, switches};
use minijinja::{Value, context, value::merge_maps};
use wgpu::Buffer;

use super::{ray_scene::Traced, traversal::Traversal};
use crate::known_samples::{Predecessors, RedundancyVariant};
use crate::{
    RenderError, batch::Recording, pixel_camera::CAMERA_TRAITS, redundancy_test::RedundancyTest, surfaces::Surfaces,
};

/// The redundant surfaces that one ray passes before it is given up: the software device ends long loops.
pub const MOST_LAYERS: u32 = 64;
/// The group of known samples.
const KNOWN_GROUP: u32 = 2;

#[derive(Debug)]
pub(crate) struct Primary {
    traversal: Traversal,
    /// `None` shows colours as they are.
    shading: Option<Highlight>,
    surface_id: bool,
    triangle_normal: bool,
    /// Rays around a pole, in place of those through one eye.
    single_pole: bool,
    redundancy: Option<RedundancyVariant>,
}

impl Primary {
    /// Redundancy is tested between pinholes alone.
    fn pinholes() -> impl Iterator<Item = Self> {
        Self::all().into_iter().filter(|variant| !variant.single_pole)
    }

    /// The variants with each redundancy test.
    pub fn with_tests(tests: &[RedundancyTest]) -> impl Iterator<Item = Self> {
        RedundancyVariant::all(tests).into_iter().flat_map(|redundancy| {
            Self::pinholes().map(move |variant| Self { redundancy: Some(redundancy), ..variant })
        })
    }
}

impl ShaderVariant for Primary {
    const TEMPLATE: &'static str = "rays/primary.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        let Self { traversal, shading, surface_id, triangle_normal, single_pole, redundancy } = *self;
        context! {
            primary => true, from_eye => true, surface_id, triangle_normal, single_pole,
            shading => shading.map_or("unlit", highlight_name),
            ..merge_maps([traversal.context(), RedundancyVariant::context(redundancy, KNOWN_GROUP)])
        }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for shading in [None, Some(Highlight::BlinnPhong), Some(Highlight::Ggx)] {
            for [surface_id, triangle_normal, single_pole] in switches() {
                all.extend(Traversal::ALL.map(|traversal| Self {
                    traversal,
                    shading,
                    surface_id,
                    triangle_normal,
                    single_pole,
                    redundancy: None,
                }));
            }
        }
        all
    }
}

/// Records one dispatch for each camera from the `first` on into its own textures. With predecessors, whose samples are not
/// shown again, there is one camera.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    traced: &Traced,
    first: usize,
    surfaces: &[Surfaces],
    predecessors: Option<&Predecessors>,
) -> Result<(), RenderError> {
    let Recording { passes, batch, .. } = recording;
    let variant = Primary {
        traversal: Traversal::of(traced),
        shading: batch.work.lighting.highlight(),
        surface_id: surfaces.iter().any(|target| target.surface_ids.is_some()),
        triangle_normal: batch.output.triangle_normal,
        single_pole: batch.is_single_pole(),
        redundancy: predecessors.map(|images| images.variant),
    };
    let pass = passes.get(&variant)?;
    let rays = pass.bind(1, traced.bindings())?;
    let known = predecessors.map(|images| pass.bind(KNOWN_GROUP, images.bindings())).transpose()?;
    for (camera, target) in (first..).zip(surfaces) {
        let own = pass.bind(0, bindings(&variant, &recording.cameras, target))?;
        let groups: Vec<_> = [&own, &rays].into_iter().chain(&known).collect();
        recording.dispatch(&variant, &pass, &groups, camera);
    }
    Ok(())
}

fn bindings<'r>(variant: &Primary, cameras: &'r Buffer, target: &'r Surfaces) -> Vec<Binding<'r>> {
    let mut bindings = vec![Binding::buffer("camera", cameras)];
    bindings.extend(target.bindings());
    let ids = target.surface_ids.as_ref().filter(|_| variant.surface_id);
    bindings.extend(ids.map(|ids| Binding::texture("surface_ids", ids)));
    bindings.extend(target.views.triangle_normal_binding().filter(|_| variant.triangle_normal));
    bindings.extend(variant.redundancy.map(|_| Binding::texture("front_depth", &target.views.front_depth)));
    bindings
}

#[cfg(test)]
mod tests {
    use depth_image::PinholeCamera;
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::test_support::{TEST, TestStage};
    use crate::{known_samples::KnownSamples, layers::LayerCache};

    fn check(stage: &TestStage, traced: &Traced, variant: &Primary) {
        let target = stage.surfaces(true, variant.surface_id);
        stage.check(variant, 0, &bindings(variant, &stage.buffer, &target));
        stage.check(variant, 1, &traced.bindings());
    }

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let traced = stage.scene.rays.at(0.0).expect("a tree");
        let camera = PinholeCamera::looking_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 0.8, UVec2::ONE);
        let known = |reference: Option<&_>| {
            KnownSamples::of(&stage.gpu, &LayerCache::default(), &[camera; 2], TEST, reference).expect("known samples")
        };
        let reference = known(None).into_reference();
        for known in [known(None), known(Some(&reference))] {
            let images = known.predecessors(&stage.gpu, 1, &camera);
            for variant in Primary::all() {
                check(&stage, &traced, &variant);
            }
            for variant in Primary::pinholes() {
                let variant = Primary { redundancy: Some(images.variant), ..variant };
                check(&stage, &traced, &variant);
                stage.check(&variant, KNOWN_GROUP, &images.bindings());
            }
        }
    }
}
