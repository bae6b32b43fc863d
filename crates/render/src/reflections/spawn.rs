//! Rays off the mirrors that a picture shows.

use depth_image::Highlight;
use gpu::{Binding, ResourceTraits, ShaderVariant, highlight_name, light_slots};
use minijinja::{Value, context, value::merge_maps};
use wgpu::Buffer;

use super::bounces::BounceList;
use crate::{
    RenderError, batch::Recording, pieces::Piece, pixel_camera::CAMERA_TRAITS, rays::Traversal, surfaces::Surfaces,
};

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
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

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
        light_count => 0, light_slots => light_slots(0), visibility_words => 0,
    }
}

/// Records the pass over a piece of a picture.
pub(super) fn record(
    recording: &mut Recording<'_>,
    piece: Piece,
    target: &Surfaces,
    next_bounces: &Buffer,
    next: &BounceList,
) -> Result<(), RenderError> {
    let batch = recording.batch;
    // Lighting with mirrors has rays.
    let Some(traced) = batch.traced.as_deref() else { return Ok(()) };
    let plane_count = batch.output.layout().count;
    let variant = Spawn { by_rays: batch.by_rays, plane_count, traversal: Traversal::of(traced) };
    let pass = recording.passes.get(&variant)?;
    let buffers = [&recording.cameras, &batch.work.scene.illumination, next_bounces];
    let own = pass.bind(0, bindings(buffers, next, target))?;
    let tree = pass.bind(1, traced.bindings())?;
    recording.dispatch_piece(recording.kind_of(&variant), &pass, &[&own, &tree], piece, piece.size());
    Ok(())
}

/// The resources of passes that list rays of a picture's pixels.
pub(super) fn bindings<'r>(
    [camera, illumination, next_bounces]: [&'r Buffer; 3],
    next: &'r BounceList,
    target: &'r Surfaces,
) -> Vec<Binding<'r>> {
    let mut bindings = vec![
        Binding::buffer("camera", camera),
        Binding::buffer("illumination", illumination),
        Binding::buffer("next_bounces", next_bounces),
        next.binding("next"),
    ];
    bindings.extend(target.bindings());
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
        let traced = stage.scene.rays.at(0.0).expect("a tree");
        for variant in Spawn::all() {
            let target = stage.surfaces(variant.by_rays, false);
            stage.check(&variant, 0, &bindings([&stage.buffer; 3], &list, &target));
            stage.check(&variant, 1, &traced.bindings());
        }
    }
}
