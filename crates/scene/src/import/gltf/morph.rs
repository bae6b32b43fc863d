//! Morph targets with their default weights. No clip moves them.

use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{MorphTarget, Primitive};

use super::document::{Document, same_count};
use crate::error::Fault;

/// Adds to `values` what the targets change, times their weights. `accessor_of` picks the attribute.
pub(super) fn add<const N: usize>(
    document: &Document,
    primitive: &Primitive,
    weights: &[f32],
    accessor_of: impl Fn(&MorphTarget) -> Option<Index<Accessor>>,
    values: &mut [[f32; N]],
    element: &str,
) -> Result<(), Fault> {
    let targets = primitive.targets.iter().flatten().zip(weights);
    for (number, (target, &weight)) in targets.enumerate().filter(|(_, (_, weight))| **weight != 0.0) {
        let Some(index) = accessor_of(target) else { continue };
        let element = format!("{element}, morph target {number}");
        if !weight.is_finite() {
            return Err(Fault::malformed(element, "its weight is not finite"));
        }
        let changes = same_count(document.floats::<3>(index, &element)?, values.len(), "an attribute", &element)?;
        for (value, change) in values.iter_mut().zip(changes) {
            value.iter_mut().zip(change).for_each(|(value, change)| *value += weight * change);
        }
    }
    Ok(())
}
