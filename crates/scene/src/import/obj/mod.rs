//! Wavefront OBJ with MTL.
//!
//! The parser here has double precision and replaces `tobj`, whose precision is that of the whole build. `tobj` also
//! drops the texture coordinates of an object in which one face has none. It panics on indices near `i64::MAX` and on
//! MTL colours of fewer than three numbers.
//!
//! Files of many programs and ages are read: a row that cannot be used is left out, and a warning counts its kind. Surfaces
//! are seen from both sides, because the format has no notion of culling. Missing normals are smooth up to creases of 60°, and
//! flat after `s off`. Axes are kept. Points, lines and free-form
//! curves are left out with a warning.

mod faces;
mod map;
mod materials;
mod mtl;
mod text;

use glam::DAffine3;

use super::{Import, SourceInstance, SourceScene};
use crate::Fault;
use faces::{Attributes, Faces};
use text::{Line, for_each_line, without_byte_order_mark};

pub(super) fn read(bytes: &[u8], import: &Import) -> Result<SourceScene, Fault> {
    let mut file = ObjFile::default();
    for_each_line(&without_byte_order_mark(bytes), "", |line| file.read_line(line, import))?;
    let mut scene = SourceScene::default();
    let libraries = materials::read_libraries(&file.libraries, import)?;
    let materials = materials::read_materials(&libraries, &file.faces.material_names, import, &mut scene)?;
    scene.meshes.push(file.faces.into_mesh(file.attributes, &materials, import)?);
    scene.instances.push(SourceInstance { mesh: 0, source_from_mesh: DAffine3::IDENTITY });
    Ok(scene)
}

/// Statements of shapes other than faces, and `call`, which names another file.
const LEFT_OUT: [&str; 6] = ["p", "l", "curv", "curv2", "surf", "call"];

#[derive(Default)]
struct ObjFile {
    attributes: Attributes,
    faces: Faces,
    /// What `mtllib` statements name.
    libraries: Vec<Vec<u8>>,
}

impl ObjFile {
    fn read_line(&mut self, line: &Line, import: &Import) -> Result<(), Fault> {
        if line.is("v") {
            self.attributes.push_position(line, import)?;
        } else if line.is("vt") {
            self.attributes.push_uv(line, &import.warnings);
        } else if line.is("vn") {
            self.attributes.push_normal(line, &import.warnings);
        } else if line.is("f") || line.is("fo") {
            self.faces.push(line, &self.attributes, import)?;
        } else if line.is("s") {
            self.faces.set_smoothing(line);
        } else if line.is("usemtl") {
            self.faces.use_material(line.rest);
        } else if line.is("mtllib") {
            self.libraries.push(line.rest.to_owned());
        } else if line.is("#MRGB") {
            self.attributes.push_mrgb(line, import.limits);
        } else if let Some(statement) = LEFT_OUT.iter().find(|statement| line.is(statement)) {
            import.warnings.list("points, lines, free-form shapes and other files are left out", statement);
        }
        Ok(())
    }
}
