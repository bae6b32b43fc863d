//! Meshes: one for each of the file, and one more for each other set of weights of its morph targets that a node names.

use std::collections::{BTreeSet, HashMap};

use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Mesh as JsonMesh, Node};

use super::super::source_scene::{SourceMesh, SourceScene};
use super::document::Document;
use super::primitives::{self, Geometry};
use super::texture_coordinates::Coordinates;
use super::textures::material_number;
use crate::Material;
use crate::error::{Fault, at_most};

/// The scene's numbers of the file's meshes.
pub(super) struct Meshes {
    count: usize,
    /// The scene's numbers of meshes whose weights are not their own, by mesh and bits of the weights.
    with_weights: HashMap<(usize, Vec<u32>), usize>,
}

impl Meshes {
    /// The scene's number of a node's mesh; `None` where the file has no such mesh.
    pub(super) fn number(&self, node: &Node) -> Option<usize> {
        let number = node.mesh?.value();
        let other = node.weights.as_ref().and_then(|weights| self.with_weights.get(&(number, bits(weights))).copied());
        (number < self.count).then(|| other.unwrap_or(number))
    }
}

fn bits(weights: &[f32]) -> Vec<u32> {
    weights.iter().map(|weight| weight.to_bits()).collect()
}

/// Mesh `i` of the file becomes mesh `i` of the scene; a mesh of lines alone stays empty.
pub(super) fn read(document: &Document, scene: &mut SourceScene) -> Result<Meshes, Fault> {
    let json = &document.root.meshes;
    let mut materials = BrightMaterials::default();
    for (number, mesh) in json.iter().enumerate() {
        let weights = mesh.weights.as_deref().unwrap_or_default();
        let merged = merged(document, number, mesh, weights, &mut materials, scene)?;
        scene.meshes.push(merged);
    }
    let mut meshes = Meshes { count: json.len(), with_weights: HashMap::new() };
    for node in &document.root.nodes {
        let (Some(index), Some(weights)) = (node.mesh, &node.weights) else { continue };
        let Some(mesh) = document.root.get(index) else { continue };
        let has_targets = mesh.primitives.iter().any(|primitive| primitive.targets.iter().flatten().next().is_some());
        let key = (index.value(), bits(weights));
        if !has_targets || mesh.weights.as_ref() == Some(weights) || meshes.with_weights.contains_key(&key) {
            continue;
        }
        at_most("meshes with weights of their own", scene.meshes.len() as u64, document.limits.nodes)?;
        let merged = merged(document, index.value(), mesh, weights, &mut materials, scene)?;
        meshes.with_weights.insert(key, scene.meshes.len());
        scene.meshes.push(merged);
    }
    Ok(meshes)
}

fn merged(
    document: &Document,
    number: usize,
    mesh: &JsonMesh,
    weights: &[f32],
    materials: &mut BrightMaterials,
    scene: &mut SourceScene,
) -> Result<SourceMesh, Fault> {
    let mut merged = SourceMesh::default();
    for (part, primitive) in mesh.primitives.iter().enumerate() {
        let element = format!("mesh {number}, primitive {part}");
        let coordinates = Coordinates::of_material(document.root, primitive.material)?;
        let material = material_number(document.root, primitive.material, &element)?;
        if let Some(geometry) = primitives::read(document, primitive, &coordinates, weights, &element)? {
            let Geometry { mesh, color_scale } = geometry;
            warn_of_missing_coordinates(
                document,
                primitive,
                &coordinates,
                &scene.materials[material as usize],
                &element,
            );
            at_most("materials", scene.materials.len() as u64, document.limits.attributes.saturating_add(1))?;
            let material = materials.number(material, color_scale, scene);
            if color_scale > 1.0 && scene.materials[material as usize].base_color_linear[..3].iter().any(|c| *c > 1.0) {
                document
                    .warnings
                    .count("colours of vertices are above 1: surfaces that stay so are shown as 1", &element);
            }
            merged.append_part(mesh, material);
        }
    }
    Ok(merged)
}

/// Warns of textures that show one texel, because the primitive lacks their coordinates.
fn warn_of_missing_coordinates(
    document: &Document,
    primitive: &Primitive,
    coordinates: &Coordinates,
    material: &Material,
    element: &str,
) {
    let needed = material.textures().into_iter().flatten();
    let sources = needed.filter_map(|used| if used.second_uv { coordinates.second } else { Some(coordinates.first) });
    let sets: BTreeSet<u32> = sources.map(|source| source.set).collect();
    for set in sets {
        if !primitive.attributes.contains_key(&Checked::Valid(Semantic::TexCoords(set))) {
            let place = format_args!("{element}, TEXCOORD_{set}");
            document.warnings.count("textures without coordinates show one texel", place);
        }
    }
}

/// Copies of materials for vertex colours above 1, which a vertex has no room for: the material takes over their scale.
#[derive(Default)]
struct BrightMaterials(HashMap<(u32, u32), u32>);

impl BrightMaterials {
    fn number(&mut self, material: u32, color_scale: f32, scene: &mut SourceScene) -> u32 {
        if color_scale == 1.0 {
            return material;
        }
        *self.0.entry((material, color_scale.to_bits())).or_insert_with(|| {
            let mut bright = scene.materials[material as usize].clone();
            bright.base_color_linear[..3].iter_mut().for_each(|c| *c = (*c * color_scale).min(f32::MAX));
            scene.materials.push(bright);
            scene.materials.len() as u32 - 1
        })
    }
}
