//! Skins: joints of vertices, and where meshes are bound to them.

use glam::{DAffine3, Mat4};
use gltf::json::mesh::Semantic;
use gltf::json::skin::Skin;

use super::document::{Document, same_count};
use super::primitives::PrimitiveReader;
use super::transforms::affine_from;
use crate::animation::Influence;
use crate::error::{Fault, at_most};

/// A vertex whose weights have a lesser sum has none.
const LEAST_SUM: f32 = 1e-6;
/// Four joints each; files with more sets are not known.
const MOST_SETS: u32 = 4;

/// Joints and weights of each vertex; empty for a primitive without. Of more than four joints the strongest four count, and
/// weights are made to sum to 1. A vertex without weights has [`Influence::NONE`]. Vertices that no triangle uses are not
/// checked.
pub(super) fn influences(reader: &PrimitiveReader, indices: &[u32], vertices: usize) -> Result<Vec<Influence>, Fault> {
    let PrimitiveReader { document, element, .. } = reader;
    let mut shares: Vec<Vec<(f32, f32)>> = Vec::new();
    for set in 0..MOST_SETS {
        let joints = reader.index(Semantic::Joints(set));
        let weights = reader.index(Semantic::Weights(set));
        let (Some(joints), Some(weights)) = (joints, weights) else { break };
        let joints = same_count(document.floats::<4>(joints, element)?, vertices, "JOINTS", element)?;
        let weights = same_count(document.floats::<4>(weights, element)?, vertices, "WEIGHTS", element)?;
        shares.resize(vertices, Vec::new());
        for (shares, (joints, weights)) in shares.iter_mut().zip(joints.into_iter().zip(weights)) {
            shares.extend(joints.into_iter().zip(weights));
        }
    }
    if shares.is_empty() {
        return Ok(Vec::new());
    }
    let mut influences = vec![Influence::NONE; vertices];
    for &vertex in indices {
        let vertex = vertex as usize;
        if influences[vertex] == Influence::NONE {
            influences[vertex] = influence(&mut shares[vertex])
                .map_err(|why| Fault::malformed(format_args!("{element}, vertex {vertex}"), why))?;
        }
    }
    Ok(influences)
}

fn influence(shares: &mut [(f32, f32)]) -> Result<Influence, String> {
    if let Some((_, weight)) = shares.iter().find(|(_, weight)| !(weight.is_finite() && *weight >= 0.0)) {
        return Err(format!("the weight {weight} is negative or not finite"));
    }
    // The sort is stable: equal weights stay in the file's order.
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    let strongest = &shares[..shares.len().min(4)];
    let kept: f32 = strongest.iter().map(|(_, weight)| weight).sum();
    let mut influence = Influence::NONE;
    if kept < LEAST_SUM {
        return Ok(influence);
    }
    if !kept.is_finite() {
        return Err("the sum of its weights is not finite".into());
    }
    for (place, &(joint, weight)) in strongest.iter().enumerate().filter(|(_, (_, weight))| *weight > 0.0) {
        let is_number = joint.fract() == 0.0 && (0.0..=f32::from(u16::MAX)).contains(&joint);
        influence.joints[place] =
            if is_number { Ok(joint as u16) } else { Err(format!("joint {joint} is no number")) }?;
        influence.weights[place] = weight / kept;
    }
    Ok(influence)
}

/// The inverse bind matrices of a skin, one for each of its joints. Those without an inverse hide their vertices.
pub(super) fn bind_matrices(document: &Document, skin: &Skin, element: &str) -> Result<Vec<DAffine3>, Fault> {
    at_most(format_args!("{element}, joints"), skin.joints.len() as u64, u64::from(u16::MAX))?;
    if skin.joints.is_empty() {
        return Err(Fault::malformed(element, "it has no joints"));
    }
    let Some(index) = skin.inverse_bind_matrices else { return Ok(vec![DAffine3::IDENTITY; skin.joints.len()]) };
    let element = format!("{element}, inverseBindMatrices");
    at_most(format_args!("{element}, matrices"), document.layout(index, &element)?.count, u64::from(u16::MAX))?;
    let matrices = document.floats::<16>(index, &element)?;
    if matrices.len() < skin.joints.len() {
        let why = format!("{} matrices for {} joints", matrices.len(), skin.joints.len());
        return Err(Fault::malformed(element, why));
    }
    let mut transforms = Vec::with_capacity(skin.joints.len());
    for (number, matrix) in matrices.iter().take(skin.joints.len()).enumerate() {
        let place = format_args!("{element}, matrix {number}");
        let transform = affine_from(Mat4::from_cols_array(matrix).as_dmat4()).filter(DAffine3::is_finite);
        let transform = transform.ok_or_else(|| Fault::malformed(place, "it is not finite, or not affine"))?;
        if transform.matrix3.determinant() == 0.0 {
            document.warnings.count("bind matrices without an inverse hide their vertices", place);
        }
        transforms.push(transform);
    }
    Ok(transforms)
}
