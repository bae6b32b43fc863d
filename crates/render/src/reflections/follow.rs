//! The surfaces where mirrored rays end.

use gpu::{ResourceTraits, ShaderVariant};
use minijinja::Value;

use super::bounces::Rays;
use crate::{RenderError, batch::Recording, rays::Traversal};

#[derive(Debug)]
pub(crate) struct Follow {
    traversal: Traversal,
}

impl ShaderVariant for Follow {
    const TEMPLATE: &'static str = "reflections/follow.wgsl";
    const TRAITS: ResourceTraits = &[];

    fn context(&self) -> Value {
        self.traversal.context_of_mirrored_rays()
    }

    fn all() -> Vec<Self> {
        Traversal::ALL.map(|traversal| Self { traversal }).into()
    }
}

/// Records the pass over the rays off one mirror.
pub(super) fn record(recording: &mut Recording<'_>, rays: Rays<'_>) -> Result<(), RenderError> {
    // Lighting with mirrors has rays.
    let Some(traced) = recording.batch.traced.clone() else { return Ok(()) };
    let variant = Follow { traversal: Traversal::of(&traced) };
    let pass = recording.passes.get(&variant)?;
    let own = pass.bind(0, rays.bindings())?;
    let tree = pass.bind(1, traced.bindings())?;
    rays.dispatch(recording, &variant, [0; 3], &pass, &[&own, &tree]);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflections::bounces::BounceList;
    use crate::test_support::TestStage;

    #[test]
    fn every_variant_is_bound_by_its_names() {
        let stage = TestStage::new();
        let traced = stage.scene.rays.at(0.0).expect("a tree");
        let list = BounceList::new(&stage.gpu, 1);
        for variant in Follow::all() {
            stage.check(&variant, 0, &Rays { bounces: &stage.buffer, list: &list, generation: 1 }.bindings());
            stage.check(&variant, 1, &traced.bindings());
        }
    }
}
