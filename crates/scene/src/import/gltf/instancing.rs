//! `EXT_mesh_gpu_instancing`: a node that places its mesh many times.

use std::collections::BTreeMap;

use glam::{DAffine3, DQuat, Quat, Vec3};
use gltf::json::accessor::Accessor;
use gltf::json::{Index, Node};
use serde::Deserialize;

use super::document::Document;
use super::json::parsed;
use crate::error::{Fault, at_most};

const NAME: &str = "EXT_mesh_gpu_instancing";

/// The extension's JSON. Further attributes are of applications.
#[derive(Deserialize)]
struct Instancing {
    attributes: BTreeMap<String, Index<Accessor>>,
}

/// The transforms from each placement to its node; the identity alone for a node without the extension. `element` names the
/// node. At most `limit` are read.
pub(super) fn placements(document: &Document, node: &Node, element: &str, limit: u64) -> Result<Vec<DAffine3>, Fault> {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
    let Some(extension) = extension else { return Ok(vec![DAffine3::IDENTITY]) };
    let element = format!("{element}, {NAME}");
    let Instancing { attributes } = parsed(extension, &element)?;
    let parts = ["TRANSLATION", "ROTATION", "SCALE"].map(|name| attributes.get(name).copied());
    let Some(&first) = parts.iter().flatten().next() else { return Ok(vec![DAffine3::IDENTITY]) };
    let count = document.layout(first, &element)?.count;
    at_most(format_args!("{element}: instances"), count, limit)?;
    let translations = values(document, parts[0], [0.0; 3], count, &element)?;
    let scales = values(document, parts[2], [1.0; 3], count, &element)?;
    let rotations = values(document, parts[1], Quat::IDENTITY.to_array(), count, &element)?;
    if translations.len() != rotations.len() || rotations.len() != scales.len() {
        return Err(Fault::malformed(element, "its attributes have different counts"));
    }
    let places = translations.into_iter().zip(rotations).zip(scales).map(|((translation, rotation), scale)| {
        let rotation = Quat::from_array(rotation).as_dquat();
        let unit = if rotation.length() > 1e-6 { rotation.normalize() } else { DQuat::IDENTITY };
        let [scale, translation] = [scale, translation].map(|v| Vec3::from(v).as_dvec3());
        DAffine3::from_scale_rotation_translation(scale, unit, translation)
    });
    let places: Vec<DAffine3> = places.collect();
    match places.iter().position(|place| !place.is_finite()) {
        Some(bad) => Err(Fault::malformed(element, format!("instance {bad} is not finite"))),
        None => Ok(places),
    }
}

/// The values of an attribute; `count` times the default for an attribute that is not there.
fn values<const N: usize>(
    document: &Document,
    index: Option<Index<Accessor>>,
    default: [f32; N],
    count: u64,
    element: &str,
) -> Result<Vec<[f32; N]>, Fault> {
    index.map_or_else(|| Ok(vec![default; count as usize]), |index| document.floats(index, element))
}
