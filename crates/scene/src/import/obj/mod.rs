//! Wavefront OBJ with MTL.
//!
//! The parser here has double precision and replaces `tobj`, whose precision is that of the whole build. `tobj` also
//! drops the texture coordinates of an object in which one face has none. It panics on indices near `i64::MAX` and on
//! MTL colours of fewer than three numbers.
//!
//! Polygons become fans. Missing normals are smooth up to creases of 60°. Axes are kept. Points, lines, free-form
//! curves and smoothing groups are skipped. A missing material library gives default materials.

mod faces;
mod mtl;
mod text;

use glam::{DAffine3, DVec3};

use super::folder::Folder;
use super::normals;
use super::source_scene::{SourceInstance, SourceMesh, SourceScene};
use crate::error::{Fault, at_most};
use crate::{Limits, MeshPart};
use faces::Faces;
use text::{Line, floats};

pub(super) fn read(bytes: &[u8], folder: &Folder, limits: &Limits) -> Result<SourceScene, Fault> {
    let text = String::from_utf8_lossy(bytes);
    let mut file = ObjFile::default();
    for line in text::lines(&text) {
        file.take(&line, limits)?;
    }
    let mut scene = SourceScene::default();
    let numbers = mtl::read_materials(&file.libraries, &file.faces.material_names, folder, limits, &mut scene)?;
    scene.meshes.push(file.faces.into_mesh(&numbers)?);
    scene.instances.push(SourceInstance { mesh: 0, source_from_mesh: DAffine3::IDENTITY });
    Ok(scene)
}

#[derive(Default)]
struct ObjFile {
    attributes: Attributes,
    faces: Faces,
    libraries: Vec<String>,
}

/// The numbered elements of faces.
#[derive(Default)]
struct Attributes {
    positions_in_source: Vec<DVec3>,
    /// Colours, one for each position once any position has one.
    colors_srgba8: Vec<[u8; 4]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
}

impl ObjFile {
    fn take(&mut self, line: &Line, limits: &Limits) -> Result<(), Fault> {
        match line.keyword {
            "v" => {
                at_most(line, self.attributes.positions_in_source.len() as u64 + 1, limits.vertices)?;
                self.attributes.take_position(line)?;
            }
            "vt" => {
                let [u, v] = floats(line, 1)?;
                // OBJ's v runs upwards.
                self.attributes.uvs.push([u as f32, 1.0 - v as f32]);
            }
            "vn" => self.attributes.normals.push(floats::<3>(line, 3)?.map(|n| n as f32)),
            "f" => self.faces.take(line, &self.attributes, limits)?,
            "usemtl" => self.faces.use_material(line.rest),
            "mtllib" => self.libraries.push(line.rest.to_owned()),
            _ => {}
        }
        Ok(())
    }
}

impl Attributes {
    /// `v x y z`, optionally followed by a weight or a colour, as several programs write it.
    fn take_position(&mut self, line: &Line) -> Result<(), Fault> {
        let [x, y, z, a, g, b] = floats::<6>(line, 3)?;
        let position = DVec3::new(x, y, z);
        let count = line.rest.split_ascii_whitespace().count();
        if count >= 6 {
            self.colors_srgba8.resize(self.positions_in_source.len(), [255; 4]);
            let [r, g, b] = [a, g, b].map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
            self.colors_srgba8.push([r, g, b, 255]);
        }
        let is_weighted = count == 4 && a != 0.0;
        self.positions_in_source.push(if is_weighted { position / a } else { position });
        Ok(())
    }
}

/// Sorts triangles by material, one part each.
fn parts_of(indices_of_material: Vec<Vec<u32>>, numbers: &[u32]) -> (Vec<u32>, Vec<MeshPart>) {
    let (mut indices, mut parts) = (Vec::new(), Vec::new());
    for (own, &material) in indices_of_material.into_iter().zip(numbers) {
        if !own.is_empty() {
            let (first_index, index_count) = (indices.len() as u32, own.len() as u32);
            parts.push(MeshPart { first_index, index_count, material });
            indices.extend(own);
        }
    }
    (indices, parts)
}

/// Makes normals for a file without normals, and fills gaps otherwise.
fn with_normals(mut mesh: SourceMesh, has_normals: bool) -> SourceMesh {
    if has_normals {
        normals::repair(&mut mesh)
    } else {
        normals::generate(&mut mesh, normals::CREASE_60_DEGREES)
    }
    mesh
}
