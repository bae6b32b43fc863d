//! A primitive's triangles.

use depth_image::srgb8_from_linear;
use glam::Vec3;
use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType};
use gltf::json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::super::polygons::triangles_of_strip;
use super::super::{SourceMesh, normals, plain_vertex};
use super::Document;
use super::document::same_count;
use super::texture_coordinates::{Coordinates, UvSource};
use crate::{Fault, Influence, Vertex, VertexDetail, at_most};

/// A primitive's triangles.
pub(super) struct Geometry {
    pub mesh: SourceMesh,
    /// Factor of the vertex colours: 1 unless some are above 1, which a vertex has no room for.
    pub color_scale: f32,
}

/// Reads the attributes of a primitive.
pub(super) struct PrimitiveReader<'a> {
    pub document: &'a Document<'a>,
    pub primitive: &'a Primitive,
    /// Those of the morph targets.
    pub weights: &'a [f32],
    /// The primitive in messages.
    pub element: &'a str,
}

impl PrimitiveReader<'_> {
    /// `None` for points and lines.
    pub(super) fn read(&self, coordinates: &Coordinates) -> Result<Option<Geometry>, Fault> {
        let Self { document, primitive, element, .. } = self;
        let Checked::Valid(mode) = primitive.mode else {
            return Err(Fault::malformed(element, "unknown mode"));
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            document.warnings.count("points and lines are left out", element);
            return Ok(None);
        }
        // Compressed strips are decoded to triangles.
        let is_decoded = primitive.indices.is_some_and(|indices| document.is_decoded(indices));
        let mode = if is_decoded { Mode::Triangles } else { mode };
        let position = self.index(Semantic::Positions);
        let position = position.ok_or_else(|| Fault::malformed(element, "it has no POSITION"))?;
        let count = document.layout(position, element)?.count;
        at_most(format_args!("{element}, vertices"), count, document.limits.vertices)?;
        let mut positions = document.floats::<3>(position, element)?;
        self.morph(|target| target.positions, &mut positions)?;
        let indices = self.triangles(mode, positions.len())?;
        let mut vertices = vec![plain_vertex(); positions.len()];
        let color_scale = self.fill(&mut vertices, &coordinates.first)?;
        let has_normals = self.index(Semantic::Normals).is_some();
        let details = self.details(positions.len(), coordinates)?;
        let positions_in_mesh: Vec<_> = positions.iter().map(|p| Vec3::from(*p).as_dvec3()).collect();
        let influences = influences(self, &indices, positions.len())?;
        let mut mesh = SourceMesh { vertices, details, positions_in_mesh, indices, parts: Vec::new(), influences };
        drop_unused(&mut mesh);
        if mesh.positions_in_mesh.iter().all(|p| p.is_finite()) {
            if has_normals {
                normals::repair(&mut mesh);
            } else {
                normals::generate(&mut mesh, normals::FLAT);
            }
            // Tangents without normals do not count (glTF 2.0, 3.7.2.1).
            let has_tangents = has_normals && self.index(Semantic::Tangents).is_some();
            if let Some(second_uv) = coordinates.tangents_along_second.filter(|_| !has_tangents) {
                normals::generate_tangents(&mut mesh, second_uv)
                    .map_err(|error| Fault::malformed(element, format!("its tangents cannot be computed: {error}")))?;
            }
        }
        Ok(Some(Geometry { mesh, color_scale }))
    }

    fn index(&self, semantic: Semantic) -> Option<Index<Accessor>> {
        self.primitive.attributes.get(&Checked::Valid(semantic)).copied()
    }

    /// `count` elements of an attribute; `None` where the primitive lacks it.
    fn floats<const N: usize>(&self, semantic: Semantic, count: usize) -> Result<Option<Vec<[f32; N]>>, Fault> {
        let name = semantic.to_string();
        let Some(index) = self.index(semantic) else { return Ok(None) };
        same_count(self.document.floats(index, self.element)?, count, &name, self.element).map(Some)
    }

    /// Adds to `values` what morph targets change, times their weights. No clip moves them. `accessor_of` picks the
    /// attribute.
    fn morph<const N: usize>(
        &self,
        accessor_of: impl Fn(&MorphTarget) -> Option<Index<Accessor>>,
        values: &mut [[f32; N]],
    ) -> Result<(), Fault> {
        let targets = self.primitive.targets.iter().flatten().zip(self.weights);
        for (number, (target, &weight)) in targets.enumerate().filter(|(_, (_, weight))| **weight != 0.0) {
            let Some(index) = accessor_of(target) else { continue };
            let element = format!("{}, morph target {number}", self.element);
            if !weight.is_finite() {
                return Err(Fault::malformed(element, "its weight is not finite"));
            }
            let changes = self.document.floats::<3>(index, &element)?;
            let changes = same_count(changes, values.len(), "an attribute", &element)?;
            for (value, change) in values.iter_mut().zip(changes) {
                value.iter_mut().zip(change).for_each(|(value, change)| *value += weight * change);
            }
        }
        Ok(())
    }

    /// Sets coordinates, colours and normals. Returns [`Geometry::color_scale`].
    fn fill(&self, vertices: &mut [Vertex], uv: &UvSource) -> Result<f32, Fault> {
        let count = vertices.len();
        let mut color_scale = 1.0;
        for (v, at) in vertices.iter_mut().zip(self.floats(Semantic::TexCoords(uv.set), count)?.unwrap_or_default()) {
            v.uv = uv.apply(at);
        }
        if let Some(index) = self.index(Semantic::Colors(0)) {
            let colors = self.linear_colors(index)?;
            let colors = same_count(colors, count, "COLOR_0", self.element)?;
            let channels = colors.iter().flat_map(|color| &color[..3]).filter(|channel| channel.is_finite());
            color_scale = channels.fold(1.0, |most: f32, &channel| most.max(channel));
            for (vertex, [r, g, b, alpha]) in vertices.iter_mut().zip(colors) {
                let [r, g, b] = [r, g, b].map(|channel| channel / color_scale);
                vertex.color_srgba8 = srgba8_from_linear([r, g, b, alpha]);
            }
        }
        let Some(mut normals) = self.floats::<3>(Semantic::Normals, count)? else {
            return Ok(color_scale);
        };
        self.morph(|target| target.normals, &mut normals)?;
        if normals.iter().any(|n| !Vec3::from(*n).is_finite()) {
            return Err(Fault::malformed(self.element, "a normal is not finite"));
        }
        vertices.iter_mut().zip(normals).for_each(|(v, normal)| v.normal = normal);
        Ok(color_scale)
    }

    fn linear_colors(&self, index: Index<Accessor>) -> Result<Vec<[f32; 4]>, Fault> {
        let layout = self.document.layout(index, self.element)?;
        // Integers are shares of their largest value (glTF 2.0, 3.7.2.1), also where a file does not say so.
        let largest = match layout.component {
            ComponentType::U8 if !layout.accessor.normalized => 255.0,
            ComponentType::U16 if !layout.accessor.normalized => 65_535.0,
            _ => 1.0,
        };
        if layout.components == 3 {
            let rgb = self.document.floats::<3>(index, self.element)?;
            Ok(rgb.into_iter().map(|[r, g, b]| [r / largest, g / largest, b / largest, 1.0]).collect())
        } else {
            let rgba = self.document.floats::<4>(index, self.element)?;
            Ok(rgba.into_iter().map(|color| color.map(|channel| channel / largest)).collect())
        }
    }

    fn triangles(&self, mode: Mode, vertex_count: usize) -> Result<Vec<u32>, Fault> {
        let indices = match self.primitive.indices {
            Some(index) => self.document.indices(index, self.element)?,
            None => (0..vertex_count as u32).collect(),
        };
        if let Some(bad) = indices.iter().find(|&&i| i as usize >= vertex_count) {
            return Err(Fault::malformed(self.element, format!("index {bad} is beyond its {vertex_count} vertices")));
        }
        match mode {
            Mode::TriangleStrip => Ok(triangles_of_strip(&indices).flatten().collect()),
            Mode::TriangleFan => Ok(from_fan(&indices)),
            _ if indices.len().is_multiple_of(3) => Ok(indices),
            _ => Err(Fault::malformed(self.element, format!("{} indices are not whole triangles", indices.len()))),
        }
    }

    /// Second coordinates and tangents, where the material needs them.
    fn details(&self, count: usize, coordinates: &Coordinates) -> Result<Vec<VertexDetail>, Fault> {
        if coordinates.second.is_none() && coordinates.tangents_along_second.is_none() {
            return Ok(Vec::new());
        }
        let mut details = vec![VertexDetail::default(); count];
        if let Some(uv) = &coordinates.second {
            let uvs = self.floats(Semantic::TexCoords(uv.set), count)?.unwrap_or_default();
            details.iter_mut().zip(uvs).for_each(|(detail, at)| detail.uv = uv.apply(at));
        }
        if coordinates.tangents_along_second.is_some() {
            let mut tangents = self.floats::<4>(Semantic::Tangents, count)?.unwrap_or_default();
            if !tangents.is_empty() {
                self.morph(|target| target.tangents, &mut tangents)?;
            }
            details.iter_mut().zip(tangents).for_each(|(detail, tangent)| detail.tangent = unit_tangent(tangent));
        }
        Ok(details)
    }
}

/// Some unit vector where the tangent has no length or is not finite.
fn unit_tangent([x, y, z, sign]: [f32; 4]) -> [f32; 4] {
    let unit = Vec3::new(x, y, z).normalize_or(Vec3::X);
    unit.extend(if sign < 0.0 { -1.0 } else { 1.0 }).to_array()
}

/// The new number of a vertex that no triangle uses.
const UNUSED: u32 = u32::MAX;

fn retain_used<T>(items: &mut Vec<T>, new_number: &[u32]) {
    let mut at = new_number.iter();
    items.retain(|_| at.next() != Some(&UNUSED));
}

/// Keeps the vertices that the triangles use: primitives may share one large set.
fn drop_unused(mesh: &mut SourceMesh) {
    let mut new_number = vec![UNUSED; mesh.vertices.len()];
    mesh.indices.iter().for_each(|&i| new_number[i as usize] = 0);
    let used = new_number.iter_mut().filter(|number| **number != UNUSED);
    used.zip(0..).for_each(|(number, kept)| *number = kept);
    retain_used(&mut mesh.vertices, &new_number);
    retain_used(&mut mesh.details, &new_number);
    retain_used(&mut mesh.positions_in_mesh, &new_number);
    retain_used(&mut mesh.influences, &new_number);
    mesh.indices.iter_mut().for_each(|i| *i = new_number[*i as usize]);
}

fn srgba8_from_linear([r, g, b, alpha]: [f32; 4]) -> [u8; 4] {
    let [r, g, b] = [r, g, b].map(srgb8_from_linear);
    [r, g, b, (alpha.clamp(0.0, 1.0) * 255.0 + 0.5) as u8]
}

fn from_fan(indices: &[u32]) -> Vec<u32> {
    let rim = indices.get(1..).unwrap_or_default();
    rim.windows(2).flat_map(|edge| [indices[0], edge[0], edge[1]]).collect()
}

/// A vertex whose weights have a lesser sum has none.
const LEAST_SUM: f32 = 1e-6;
/// Four joints each; files with more sets are not known.
const MOST_SETS: u32 = 4;

/// Joints and weights of each vertex; empty for a primitive without. Of more than four joints the strongest four count, and
/// weights are made to sum to 1. A vertex without weights has [`Influence::NONE`]. Vertices that no triangle uses are not
/// checked.
fn influences(reader: &PrimitiveReader, indices: &[u32], vertices: usize) -> Result<Vec<Influence>, Fault> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn from_strip(indices: &[u32]) -> Vec<[u32; 3]> {
        triangles_of_strip(indices).collect()
    }

    #[test]
    fn strips_alternate_and_fans_share_their_hub() {
        assert_eq!(from_strip(&[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(from_strip(&[0, 1, 2, 2, 3, 3, 4, 5]), [[0, 1, 2], [4, 3, 5]]);
        assert_eq!(from_fan(&[0, 1, 2, 3]), [0, 1, 2, 0, 2, 3]);
        assert!(from_strip(&[0, 1]).is_empty() && from_fan(&[]).is_empty());
    }
}
