//! Surfaces by one ray a pixel.

use depth_image::Highlight;
use gpu::{ShaderVariant, highlight_name, switches};
use minijinja::{Value, context, value::merge_maps};

use super::{ray_scene::Traced, traversal::Traversal};
use crate::known_samples::{Predecessors, RedundancyVariant};
use crate::{RenderError, batch::Recording, redundancy_test::RedundancyTest, surfaces::Surfaces};

/// The redundant surfaces that one ray passes before it is given up: the software device ends long loops.
pub const MOST_LAYERS: u32 = 64;
/// The group of known samples.
const KNOWN_GROUP: u32 = 2;

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Primary {
    traversal: Traversal,
    /// `None` shows colours as they are.
    shading: Option<Highlight>,
    surface_id: bool,
    triangle_normal: bool,
    /// Rays around a pole, in place of those through one eye.
    single_pole: bool,
    /// Pixels that show glass are marked.
    marks_glass: bool,
    redundancy: Option<RedundancyVariant>,
}

impl Primary {
    /// The variants with each redundancy test.
    pub fn with_tests(tests: &[RedundancyTest]) -> impl Iterator<Item = Self> {
        RedundancyVariant::all(tests).into_iter().flat_map(|redundancy| {
            Self::all()
                .into_iter()
                .filter(|variant| !variant.single_pole)
                .map(move |variant| Self { redundancy: Some(redundancy), ..variant })
        })
    }
}

impl ShaderVariant for Primary {
    const TEMPLATE: &'static str = "rays/primary.wgsl";

    fn context(&self) -> Value {
        let Self { traversal, shading, surface_id, triangle_normal, single_pole, marks_glass, redundancy } = *self;
        context! {
            primary => true, from_eye => true, surface_id, triangle_normal, single_pole, marks_glass,
            shading => shading.map_or("unlit", highlight_name),
            ..merge_maps([traversal.context(), RedundancyVariant::context(redundancy, KNOWN_GROUP)])
        }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for shading in [None, Some(Highlight::BlinnPhong), Some(Highlight::Ggx)] {
            for [surface_id, triangle_normal, single_pole] in switches() {
                let plain = Self { shading, surface_id, triangle_normal, single_pole, ..Self::default() };
                all.extend(Traversal::ALL.map(|traversal| Self { traversal, ..plain }));
            }
        }
        let with_glass =
            all.iter().filter(|variant| variant.traversal.glass && variant.shading == Some(Highlight::Ggx));
        let marked: Vec<Self> = with_glass.map(|variant| Self { marks_glass: true, ..*variant }).collect();
        all.extend(marked);
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
    let batch = recording.batch;
    let variant = Primary {
        traversal: traced.traversal,
        shading: batch.work.lighting.highlight(),
        surface_id: surfaces.iter().any(|target| target.surface_ids.is_some()),
        triangle_normal: batch.output.triangle_normal,
        single_pole: batch.is_single_pole(),
        marks_glass: batch.output.glass,
        redundancy: predecessors.map(|images| images.variant),
    };
    for (camera, target) in (first..).zip(surfaces) {
        let known = predecessors.into_iter().flat_map(Predecessors::bindings);
        let bound = recording.bind(&variant, (), target.bindings().chain(known))?;
        recording.dispatch(&bound, camera);
    }
    Ok(())
}
