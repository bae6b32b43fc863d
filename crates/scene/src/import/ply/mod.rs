//! PLY, ASCII and binary, by `serde-ply`, which streams rows. Sizes are checked against the file first.
//!
//! The importer reads two elements. `vertex` has x y z, nx ny nz, red green blue alpha (sRGB bytes, or 0…1), and s t, u
//! v or texture_u texture_v. `face` has vertex_indices or vertex_index; polygons become fans. Missing normals are
//! smooth up to creases of 60°. Axes are kept. Other elements are skipped.

mod header;

use std::io::{BufRead, Read};

use glam::{DAffine3, DVec3};
use serde::{Deserialize, de::MapAccess};
use serde_ply::{PlyReader, RowVisitor};

use super::folder::Folder;
use super::normals;
use super::source_scene::{SourceInstance, SourceMesh, SourceScene, plain_vertex};
use crate::error::{Fault, at_most};
use crate::{Limits, Material, MeshPart, Vertex};

pub(super) fn read(bytes: &[u8], _folder: &Folder, limits: &Limits) -> Result<SourceScene, Fault> {
    // The last number of an ASCII file may lack the white space that ends it.
    let reader =
        PlyReader::from_reader(bytes.chain(&b"\n"[..])).map_err(|e| Fault::malformed("header", e.to_string()))?;
    header::check(reader.header(), bytes.len() as u64, limits)?;
    let (mut mesh, has_normals) = read_elements(reader, limits)?;
    let index_count = mesh.indices.len() as u32;
    mesh.parts.push(MeshPart { first_index: 0, index_count, material: 0 });
    normals::complete(&mut mesh, has_normals, normals::CREASE_60_DEGREES);
    Ok(SourceScene {
        meshes: vec![mesh],
        instances: vec![SourceInstance { mesh: 0, source_from_mesh: DAffine3::IDENTITY }],
        materials: vec![Material { name: "vertex colours".into(), ..Material::default() }],
        ..SourceScene::default()
    })
}

fn read_elements(mut reader: PlyReader<impl BufRead>, limits: &Limits) -> Result<(SourceMesh, bool), Fault> {
    let mut mesh = SourceMesh::default();
    let mut has_normals = false;
    while let Some(element) = reader.current_element() {
        let name = element.name.clone();
        match name.as_str() {
            "vertex" => {
                let color_scale = header::color_scale(element);
                has_normals = element.has_property("nx");
                read_vertices(&mut reader, color_scale, &mut mesh)?;
            }
            "face" => read_faces(&mut reader, &mut mesh, limits)?,
            _ => each_row(&mut reader, |_: SkippedRow| Ok(())).map_err(|why| Fault::malformed(&name, why))?,
        }
    }
    let vertex_count = mesh.vertices.len();
    if let Some(bad) = mesh.indices.iter().find(|&&i| i as usize >= vertex_count) {
        return Err(Fault::malformed("face", format!("index {bad} is beyond its {vertex_count} vertices")));
    }
    Ok((mesh, has_normals))
}

fn read_vertices(reader: &mut PlyReader<impl BufRead>, color_scale: f32, mesh: &mut SourceMesh) -> Result<(), Fault> {
    each_row(reader, |row: VertexRow| {
        let (position, vertex) = row.vertex(color_scale)?;
        mesh.positions_in_mesh.push(position);
        mesh.vertices.push(vertex);
        Ok(())
    })
    .map_err(|why| Fault::malformed(format!("vertex {}", mesh.vertices.len()), why))
}

fn read_faces(reader: &mut PlyReader<impl BufRead>, mesh: &mut SourceMesh, limits: &Limits) -> Result<(), Fault> {
    let mut face = 0u64;
    let result = each_row(reader, |row: FaceRow| {
        row.append_fan(&mut mesh.indices)?;
        face += 1;
        if mesh.indices.len() as u64 / 3 > limits.triangles { Err(TOO_MANY.to_owned()) } else { Ok(()) }
    });
    at_most("triangles", mesh.indices.len() as u64 / 3, limits.triangles)?;
    result.map_err(|why| Fault::malformed(format!("face {face}"), why))
}

const TOO_MANY: &str = "too many triangles";

/// Passes the rows of the reader's next element to `take`, up to the first that it refuses.
fn each_row<'de, R: BufRead, T: Deserialize<'de>>(
    mut reader: &mut PlyReader<R>,
    mut take: impl FnMut(T) -> Result<(), String>,
) -> Result<(), String> {
    let mut refused = None;
    let mut visitor = RowVisitor::new(|row| {
        if refused.is_none() {
            refused = take(row).err();
        }
    });
    let read = reader.next_value_seed(&mut visitor);
    match refused {
        Some(why) => Err(why),
        None => read.map_err(|e| e.0.to_string()),
    }
}

/// A vertex of numbers of any type. Position and colour come first, and no field has an alias, so that `serde-ply`
/// reads common rows by offset instead of by name. The header has shown that there is a position.
#[derive(Default, Deserialize)]
#[serde(default)]
struct VertexRow {
    x: f64,
    y: f64,
    z: f64,
    red: Option<f32>,
    green: Option<f32>,
    blue: Option<f32>,
    alpha: Option<f32>,
    nx: f32,
    ny: f32,
    nz: f32,
    s: Option<f32>,
    t: Option<f32>,
    u: Option<f32>,
    v: Option<f32>,
    texture_u: Option<f32>,
    texture_v: Option<f32>,
}

/// A polygon.
#[derive(Deserialize)]
struct FaceRow {
    #[serde(alias = "vertex_index")]
    vertex_indices: Vec<u32>,
}

/// A row of an element that scenes do not use.
#[derive(Deserialize)]
struct SkippedRow {}

impl VertexRow {
    fn vertex(&self, color_scale: f32) -> Result<(DVec3, Vertex), String> {
        let position = DVec3::new(self.x, self.y, self.z);
        let normal = [self.nx, self.ny, self.nz];
        let u = self.s.or(self.u).or(self.texture_u).unwrap_or(0.0);
        let v = self.t.or(self.v).or(self.texture_v).unwrap_or(0.0);
        if !position.is_finite() || !normal.iter().chain(&[u, v]).all(|v| v.is_finite()) {
            return Err("a position, normal or texture coordinate is not finite".into());
        }
        let byte = |channel: Option<f32>| channel.map_or(255, |c| (c * color_scale + 0.5) as u8);
        let color_srgba8 = [byte(self.red), byte(self.green), byte(self.blue), byte(self.alpha)];
        // PLY's v runs upwards.
        Ok((position, Vertex { normal, uv: [u, 1.0 - v], color_srgba8, ..plain_vertex() }))
    }
}

impl FaceRow {
    fn append_fan(&self, indices: &mut Vec<u32>) -> Result<(), String> {
        let [hub, rim @ ..] = self.vertex_indices.as_slice() else {
            return Err("it has no corners".into());
        };
        if rim.len() < 2 {
            return Err(format!("it has {} corners", rim.len() + 1));
        }
        indices.extend(rim.windows(2).flat_map(|edge| [*hub, edge[0], edge[1]]));
        Ok(())
    }
}
