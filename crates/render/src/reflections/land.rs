//! The light from the ends of mirrored rays, added to the pixels, and the rays off mirrors among those ends.

use depth_image::Highlight;
use gpu::{Binding, GpuEnvironment, ResourceTraits, ShaderVariant, highlight_name, switches};
use minijinja::{Value, context};
use wgpu::Buffer;

use super::bounces::{BounceList, Rays};
use crate::{RenderError, batch::Recording, pixel_camera::CAMERA_TRAITS, sums::SumPlanes};

#[derive(Debug)]
pub(crate) struct Land {
    /// Mirrors send rays on; else they show lamps and the environment.
    mirrors: bool,
    environment_map: bool,
    sums: SumPlanes,
}

impl ShaderVariant for Land {
    const TEMPLATE: &'static str = "reflections/land.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        let Self { mirrors, environment_map, sums } = *self;
        let highlight = highlight_name(Highlight::Ggx);
        context! { mirrors, environment_map, highlight, lit => true, single_pole => false, ..sums.context() }
    }

    fn all() -> Vec<Self> {
        let sums = SumPlanes::all().filter(|sums| sums.visibility);
        sums.flat_map(|sums| switches().map(move |[mirrors, environment_map]| Self { mirrors, environment_map, sums }))
            .collect()
    }
}

/// Records the pass over the rays off one mirror; those off the next are listed, if there is to be one.
pub(super) fn record(
    recording: &mut Recording<'_>,
    [camera, sums, reflected]: [&Buffer; 3],
    rays: Rays<'_>,
    next: Option<(&Buffer, &BounceList)>,
) -> Result<(), RenderError> {
    let scene = recording.batch.work.scene;
    let map = scene.environment.as_deref();
    let variant = Land { mirrors: next.is_some(), environment_map: map.is_some(), sums: recording.batch.output.sums };
    let pass = recording.passes.get(&variant)?;
    let buffers = [camera, &scene.illumination, sums, reflected];
    let own = pass.bind(0, bindings(buffers, rays, next, map))?;
    rays.dispatch(recording, &variant, [0; 3], &pass, &[&own]);
    Ok(())
}

fn bindings<'r>(
    [camera, illumination, sums, reflected]: [&'r Buffer; 4],
    rays: Rays<'r>,
    next: Option<(&'r Buffer, &'r BounceList)>,
    map: Option<&'r GpuEnvironment>,
) -> Vec<Binding<'r>> {
    let mut bindings = vec![
        Binding::buffer("camera", camera),
        Binding::buffer("illumination", illumination),
        Binding::buffer("sums", sums),
        Binding::buffer("reflected", reflected),
        Binding::buffer("bounces", rays.bounces),
        rays.list.binding("list"),
    ];
    bindings.extend(
        next.into_iter().flat_map(|(bounces, list)| [Binding::buffer("next_bounces", bounces), list.binding("next")]),
    );
    bindings.extend(map.into_iter().flat_map(GpuEnvironment::bindings));
    bindings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::TestStage;

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let list = BounceList::new(&stage.gpu, 1);
        let rays = Rays { bounces: &stage.buffer, list: &list, generation: 1 };
        for variant in Land::all() {
            let map = variant.environment_map.then_some(&stage.environment);
            let next = variant.mirrors.then_some((&stage.buffer, &list));
            stage.check(&variant, 0, &bindings([&stage.buffer; 4], rays, next, map));
        }
    }
}
