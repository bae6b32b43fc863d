//! PLY, ASCII and binary, by `serde-ply`, which streams rows. Sizes are checked against the file first.
//!
//! The importer reads three elements. `vertex` has x y z, nx ny nz, red green blue alpha (sRGB), and s t. `face` has
//! vertex_indices, and may have a colour, texcoord and texnumber. `tristrips` has vertex_indices. `header` lists other names
//! of these properties. `comment TextureFile` names textures. Polygons of any shape are cut into triangles. Surfaces are seen
//! from both sides. Missing normals are smooth up to creases of 60°. Axes are kept. Other elements are skipped.

mod header;
mod surface;

use std::io::{BufRead, Read};
use std::path::Path;

use glam::DAffine3;
use serde::{Deserialize, de::MapAccess};
use serde_ply::{PlyReader, RowVisitor};

use super::picture::{Content, TextureFiles, TextureReference};
use super::vertex_colors::ColorRange;
use super::{Import, SourceInstance, SourceScene, decoded};
use crate::{Fault, Material, TextureUse, at_most};
use header::{PlyText, color_range};
use surface::{FaceRow, Surface, VertexRow, Vertices};

pub(super) fn read(bytes: &[u8], import: &Import) -> Result<SourceScene, Fault> {
    let text = PlyText::parse(bytes)?;
    // The last number of an ASCII file may lack the white space that ends it.
    let rows = text.header.as_bytes().chain(&*text.body).chain(&b"\n"[..]);
    let reader = PlyReader::from_reader(rows).map_err(|e| Fault::malformed("header", e.to_string()))?;
    header::check(reader.header(), bytes.len() as u64, import.limits)?;
    let (vertices, surface) = read_elements(reader, import)?;
    let has_uvs = vertices.has_uvs || !surface.uvs.is_empty();
    let mut scene = SourceScene::default();
    if !has_uvs && !text.texture_files.is_empty() {
        import.warnings.list("textures without coordinates are not shown", decoded(text.texture_files[0]));
    } else if !text.texture_files.is_empty() {
        read_textures(&text.texture_files, import, &mut scene)?;
    }
    let textured_count = scene.materials.len() as u32;
    let white = Material { name: "vertex colours".into(), double_sided: true, ..Material::default() };
    scene.materials.push(white);
    scene.meshes.push(surface.into_mesh(&vertices, textured_count, import)?);
    scene.instances.push(SourceInstance { mesh: 0, source_from_mesh: DAffine3::IDENTITY });
    Ok(scene)
}

/// Reads the texture files, and makes a material of each.
fn read_textures(names: &[&[u8]], import: &Import, scene: &mut SourceScene) -> Result<(), Fault> {
    at_most("texture files", names.len() as u64, import.limits.attributes)?;
    let mut files = TextureFiles::default();
    for name in names {
        let shown_name = decoded(name).into_owned();
        let element = format!("TextureFile {shown_name}");
        let base = Path::new("");
        let reference = TextureReference { element, names: vec![name], base, content: Content::Colors };
        let texture = files.number_of(reference, import)?;
        let base_color_texture = Some(TextureUse::from(texture));
        let material = Material { name: shown_name, double_sided: true, base_color_texture, ..Material::default() };
        scene.materials.push(material);
    }
    scene.textures = files.decode(import)?;
    Ok(())
}

fn read_elements(mut reader: PlyReader<impl BufRead>, import: &Import) -> Result<(Vertices, Surface), Fault> {
    let Import { limits, warnings, .. } = import;
    let mut vertices = Vertices::default();
    let mut surface = Surface::default();
    while let Some(element) = reader.current_element() {
        let name = element.name.clone();
        match name.as_str() {
            "vertex" => {
                vertices.colors.range = color_range(element);
                vertices.has_uvs = element.has_property("s");
                each_row(&mut reader, |row: VertexRow| vertices.push(&row, warnings))
                    .map_err(|why| Fault::malformed(format!("vertex {}", vertices.positions_in_source.len()), why))?;
            }
            "face" | "tristrips" => {
                let are_strips = name == "tristrips";
                let range = color_range(element);
                surface.colors.range = if range == ColorRange::None { surface.colors.range } else { range };
                let mut row_number = 0u64;
                let read = each_row(&mut reader, |row: FaceRow| {
                    // A file over the limit is refused below: further rows would only take memory.
                    let is_within_limit = surface.triangle_count <= limits.triangles;
                    if is_within_limit && are_strips {
                        surface.push_strips(&row.vertex_indices);
                    } else if is_within_limit {
                        surface.push(&row, row_number, warnings);
                    }
                    row_number += 1;
                });
                at_most("triangles", surface.triangle_count, limits.triangles)?;
                read.map_err(|why| Fault::malformed(format!("{name} {row_number}"), why))?;
            }
            _ => each_row(&mut reader, |_: SkippedRow| ()).map_err(|why| Fault::malformed(&name, why))?,
        }
    }
    Ok((vertices, surface))
}

/// A row of an element that scenes do not use.
#[derive(Deserialize)]
struct SkippedRow {}

/// Passes the rows of the reader's next element to `take`.
fn each_row<'de, R: BufRead, T: Deserialize<'de>>(
    mut reader: &mut PlyReader<R>,
    take: impl FnMut(T),
) -> Result<(), String> {
    reader.next_value_seed(&mut RowVisitor::new(take)).map_err(|e| e.0.to_string())
}
