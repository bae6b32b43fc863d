//! `EXT_mesh_gpu_instancing`: a node that places its mesh many times.

use std::collections::BTreeMap;

use glam::{DAffine3, DQuat, DVec3, Quat, Vec3};
use gltf::json::accessor::Accessor;
use gltf::json::{Index, Node, deserialize};
use serde::Deserialize;

use super::document::Document;
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
    let wrong = |error: gltf::json::Error| Fault::malformed(&element, error.to_string());
    let Instancing { attributes } = deserialize::from_value(extension.clone()).map_err(wrong)?;
    let attribute = |name: &str| attributes.get(name).copied();
    let parts = [attribute("TRANSLATION"), attribute("ROTATION"), attribute("SCALE")];
    let Some(first) = parts.iter().flatten().next() else { return Ok(vec![DAffine3::IDENTITY]) };
    let count = document.element_count(*first, &element)?;
    at_most(format_args!("{element}: instances"), count, limit)?;
    let vectors = |index: Option<Index<Accessor>>, default: Vec3| match index {
        Some(index) => document.floats::<3>(index, &element).map(|all| all.into_iter().map(Vec3::from).collect()),
        None => Ok(vec![default; count as usize]),
    };
    let translations: Vec<Vec3> = vectors(parts[0], Vec3::ZERO)?;
    let scales: Vec<Vec3> = vectors(parts[2], Vec3::ONE)?;
    let rotations: Vec<Quat> = match parts[1] {
        Some(index) => document.floats::<4>(index, &element)?.into_iter().map(Quat::from_array).collect(),
        None => vec![Quat::IDENTITY; count as usize],
    };
    if translations.len() != rotations.len() || rotations.len() != scales.len() {
        return Err(Fault::malformed(element, "its attributes have different counts"));
    }
    let places = translations.iter().zip(&rotations).zip(&scales);
    let places = places.map(|((translation, rotation), scale)| {
        let rotation = rotation.as_dquat();
        let unit = if rotation.length() > 1e-6 { rotation.normalize() } else { DQuat::IDENTITY };
        DAffine3::from_scale_rotation_translation(DVec3::from(*scale), unit, DVec3::from(*translation))
    });
    let places: Vec<DAffine3> = places.collect();
    match places.iter().position(|place| !place.is_finite()) {
        Some(bad) => Err(Fault::malformed(element, format!("instance {bad} is not finite"))),
        None => Ok(places),
    }
}
