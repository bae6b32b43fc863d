//! The checks of a PLY header before a row is read.

use serde_ply::{ElementDef, PlyFormat, PlyHeader, PropertyType, ScalarType};

use crate::Limits;
use crate::error::{Fault, at_most};

/// Refuses counts that exceed the file's length or the limits, rows without properties, and files without vertices or
/// faces.
pub(super) fn check(header: &PlyHeader, file_bytes: u64, limits: &Limits) -> Result<(), Fault> {
    let mut least_bytes = 0u64;
    for element in &header.elem_defs {
        let name = format!("header, element {}", element.name);
        let count = element.count as u64;
        let row = element.properties.iter().map(|p| least_property_bytes(&p.property_type, header.format)).sum::<u64>();
        if row == 0 && count > 0 {
            return Err(Fault::malformed(name, "it has rows but no properties"));
        }
        least_bytes = least_bytes.saturating_add(count.saturating_mul(row));
        // The extra byte is for the last number of an ASCII file, which needs no white space after it.
        if least_bytes > file_bytes + 1 {
            return Err(Fault::malformed(name, format!("{count} rows do not fit a file of {file_bytes} bytes")));
        }
    }
    let vertex =
        header.get_element("vertex").ok_or_else(|| Fault::malformed("header", "there is no element vertex"))?;
    at_most("header, element vertex", vertex.count as u64, limits.vertices)?;
    let has_position = ["x", "y", "z"].iter().all(|name| vertex.has_property(name));
    let faces = header.get_element("face").filter(|face| face.count > 0);
    let face = faces.ok_or_else(|| Fault::unsupported("file", "point clouds: it has no faces, so no surface"))?;
    let has_corners = face.has_property("vertex_indices") || face.has_property("vertex_index");
    if !has_position || !has_corners {
        return Err(Fault::malformed("header", "vertex needs x, y, z, and face needs vertex_indices"));
    }
    Ok(())
}

/// Factor from a colour channel to a byte: integers are bytes, floats are 0…1.
pub(super) fn color_scale(vertex: &ElementDef) -> f32 {
    match vertex.get_property("red").map(|p| &p.property_type) {
        Some(PropertyType::Scalar(ScalarType::F32 | ScalarType::F64)) => 255.0,
        Some(PropertyType::Scalar(ScalarType::U16)) => 255.0 / 65_535.0,
        _ => 1.0,
    }
}

fn least_property_bytes(property: &PropertyType, format: PlyFormat) -> u64 {
    let scalar = match property {
        PropertyType::Scalar(scalar) => *scalar,
        // An empty list is its count.
        PropertyType::List { count_type, .. } => *count_type,
    };
    if format == PlyFormat::Ascii {
        return 2;
    }
    match scalar {
        ScalarType::I8 | ScalarType::U8 => 1,
        ScalarType::I16 | ScalarType::U16 => 2,
        ScalarType::I32 | ScalarType::U32 | ScalarType::F32 => 4,
        ScalarType::F64 => 8,
    }
}
