//! Meshes: one for each of the file, and one more for each other set of weights of its morph targets that a node names.

use std::collections::{BTreeSet, HashMap};

use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Mesh as JsonMesh, Node};

use super::super::{SourceMesh, SourceScene};
use super::Document;
use super::primitives::{Geometry, PrimitiveReader};
use super::texture_coordinates::Coordinates;
use super::textures::material_number;
use crate::{Fault, at_most};

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
pub(super) fn read(document: &Document, coordinates: &[Coordinates], scene: &mut SourceScene) -> Result<Meshes, Fault> {
    let json = &document.root.meshes;
    let mut reader = MeshReader { document, coordinates, scene, bright_materials: HashMap::new() };
    for (number, mesh) in json.iter().enumerate() {
        reader.add(number, mesh, mesh.weights.as_deref().unwrap_or_default())?;
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
        let number = reader.scene.meshes.len();
        at_most("meshes with weights of their own", number as u64, document.limits.nodes)?;
        reader.add(index.value(), mesh, weights)?;
        meshes.with_weights.insert(key, number);
    }
    Ok(meshes)
}

/// Adds meshes to a scene whose materials have been read.
struct MeshReader<'a> {
    document: &'a Document<'a>,
    /// Those of each material of the file, and of the default one.
    coordinates: &'a [Coordinates],
    scene: &'a mut SourceScene,
    /// Copies of materials for vertex colours above 1, which a vertex has no room for: the material takes over their
    /// scale. The key is a material and the bits of the scale.
    bright_materials: HashMap<(u32, u32), u32>,
}

impl MeshReader<'_> {
    fn add(&mut self, number: usize, mesh: &JsonMesh, weights: &[f32]) -> Result<(), Fault> {
        let Document { root, limits, warnings, .. } = self.document;
        let mut merged = SourceMesh::default();
        for (part, primitive) in mesh.primitives.iter().enumerate() {
            let element = format!("mesh {number}, primitive {part}");
            let material = material_number(root, primitive.material, &element)?;
            let coordinates = &self.coordinates[material as usize];
            let reader = PrimitiveReader { document: self.document, primitive, weights, element: &element };
            let Some(Geometry { mesh, color_scale }) = reader.read(coordinates)? else { continue };
            self.warn_of_missing_coordinates(primitive, coordinates, material, &element);
            at_most("materials", self.scene.materials.len() as u64, limits.attributes.saturating_add(1))?;
            let material = self.bright_material(material, color_scale);
            let color = self.scene.materials[material as usize].base_color_linear;
            if color_scale > 1.0 && color[..3].iter().any(|c| *c > 1.0) {
                warnings.count("colours of vertices are above 1: surfaces that stay so are shown as 1", &element);
            }
            merged.append_part(mesh, material);
        }
        self.scene.meshes.push(merged);
        Ok(())
    }

    /// Warns of textures that show one texel, because the primitive lacks their coordinates.
    fn warn_of_missing_coordinates(
        &self,
        primitive: &Primitive,
        coordinates: &Coordinates,
        material: u32,
        element: &str,
    ) {
        let needed = self.scene.materials[material as usize].textures().into_iter().flatten();
        let sources =
            needed.filter_map(|used| if used.second_uv { coordinates.second } else { Some(coordinates.first) });
        let sets: BTreeSet<u32> = sources.map(|source| source.set).collect();
        for set in sets {
            if !primitive.attributes.contains_key(&Checked::Valid(Semantic::TexCoords(set))) {
                let place = format_args!("{element}, TEXCOORD_{set}");
                self.document.warnings.count("textures without coordinates show one texel", place);
            }
        }
    }

    fn bright_material(&mut self, material: u32, color_scale: f32) -> u32 {
        if color_scale == 1.0 {
            return material;
        }
        let materials = &mut self.scene.materials;
        *self.bright_materials.entry((material, color_scale.to_bits())).or_insert_with(|| {
            let mut bright = materials[material as usize].clone();
            bright.base_color_linear[..3].iter_mut().for_each(|c| *c = (*c * color_scale).min(f32::MAX));
            materials.push(bright);
            materials.len() as u32 - 1
        })
    }
}
