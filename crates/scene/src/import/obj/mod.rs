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

use glam::DAffine3;

use super::folder::Folder;
use super::source_scene::{SourceInstance, SourceScene};
use crate::Limits;
use crate::error::{Fault, at_most};
use faces::{Attributes, Faces};
use text::{Line, floats};

pub(super) fn read(bytes: &[u8], folder: &Folder, limits: &Limits) -> Result<SourceScene, Fault> {
    let text = String::from_utf8_lossy(bytes);
    let mut file = ObjFile::default();
    for line in text::lines(&text) {
        file.read_line(&line, limits)?;
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

impl ObjFile {
    fn read_line(&mut self, line: &Line, limits: &Limits) -> Result<(), Fault> {
        match line.keyword {
            "v" => {
                at_most(line, self.attributes.positions_in_source.len() as u64 + 1, limits.vertices)?;
                self.attributes.push_position(line)?;
            }
            "vt" => {
                let [u, v] = floats(line, 1)?;
                // OBJ's v runs upwards.
                self.attributes.uvs.push([u as f32, 1.0 - v as f32]);
            }
            "vn" => self.attributes.normals.push(floats::<3>(line, 3)?.map(|n| n as f32)),
            "f" => self.faces.push(line, &self.attributes, limits)?,
            "usemtl" => self.faces.use_material(line.rest),
            "mtllib" => self.libraries.push(line.rest.to_owned()),
            _ => {}
        }
        Ok(())
    }
}
