//! PLY headers: names of several programs are changed to those of the rows here, and sizes are checked before a row is read.

use std::borrow::Cow;

use serde_ply::{ElementDef, PlyFormat, PlyHeader, PropertyType, ScalarType};

use super::super::decoded;
use super::super::vertex_colors::ColorRange;
use crate::{Fault, Limits, at_most};

/// The longest header: that of a file of many textures has some kilobytes.
const MAX_HEADER_BYTES: usize = 1 << 20;

/// A file whose header has the names of the rows here.
pub(super) struct PlyText<'b> {
    pub header: String,
    pub body: Cow<'b, [u8]>,
    /// The names of `comment TextureFile`, in order.
    pub texture_files: Vec<&'b [u8]>,
}

/// The properties of an element that are renamed, if all of a group are there, and none of the new names.
const RENAMED: [(&[&str], &[&str]); 7] = [
    (&["diffuse_red", "diffuse_green", "diffuse_blue"], &["red", "green", "blue"]),
    (&["r", "g", "b"], &["red", "green", "blue"]),
    (&["u", "v"], &["s", "t"]),
    (&["texture_u", "texture_v"], &["s", "t"]),
    (&["texture_s", "texture_t"], &["s", "t"]),
    (&["vertex_index"], &["vertex_indices"]),
    (&["a"], &["alpha"]),
];

impl<'b> PlyText<'b> {
    /// Splits a file after its header. A byte order mark is skipped; lines end with LF, CR or both.
    pub(super) fn parse(bytes: &'b [u8]) -> Result<Self, Fault> {
        let mut rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let first_end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let end: &[u8] = match first_end.map(|at| &rest[at..]) {
            Some([b'\r', b'\n', ..]) => b"\r\n",
            Some([b'\r', ..]) => b"\r",
            _ => b"\n",
        };
        let mut lines: Vec<Vec<&'b [u8]>> = Vec::new();
        let mut texture_files = Vec::new();
        loop {
            let header_left = MAX_HEADER_BYTES.saturating_sub(bytes.len() - rest.len()).min(rest.len());
            let Some(at) = rest[..header_left].windows(end.len()).position(|bytes| bytes == end) else {
                return Err(Fault::malformed("header", "there is no end_header in its first megabyte"));
            };
            let line = rest[..at].trim_ascii();
            rest = &rest[at + end.len()..];
            texture_files.extend(texture_file(line));
            let words: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
            let is_end = words.first() == Some(&&b"end_header"[..]);
            let is_comment = words.first().is_none_or(|word| matches!(*word, b"comment" | b"obj_info"));
            if !is_comment {
                lines.push(words);
            }
            if is_end {
                break;
            }
        }
        let is_ascii = lines.iter().any(|line| line.starts_with(&[b"format", b"ascii"]));
        let body = if is_ascii { readable(rest, end) } else { Cow::Borrowed(rest) };
        Ok(Self { header: renamed(lines), body, texture_files })
    }
}

fn texture_file(line: &[u8]) -> Option<&[u8]> {
    let comment = line.strip_prefix(b"comment")?.trim_ascii();
    let (keyword, name) = comment.split_at_checked(b"TextureFile".len())?;
    keyword.eq_ignore_ascii_case(b"TextureFile").then(|| name.trim_ascii()).filter(|name| !name.is_empty())
}

/// The header's text with lines that end with LF and names of properties in lower case, as the rows here have them.
fn renamed(lines: Vec<Vec<&[u8]>>) -> String {
    let mut lines: Vec<Vec<String>> =
        lines.iter().map(|line| line.iter().map(|word| decoded(word).into_owned()).collect()).collect();
    for element in lines.chunk_by_mut(|_, next| next[0] == "property") {
        let properties = element.iter_mut().filter(|line| line[0] == "property");
        let mut names: Vec<&mut String> = properties.filter_map(|line| line.last_mut()).collect();
        names.iter_mut().for_each(|name| name.make_ascii_lowercase());
        for (old, new) in RENAMED {
            let has = |wanted: &&str| names.iter().any(|name| *name == wanted);
            if old.iter().all(has) && !new.iter().any(has) {
                for name in &mut names {
                    if let Some(number) = old.iter().position(|old| *name == old) {
                        **name = new[number].to_owned();
                    }
                }
            }
        }
    }
    lines.iter().map(|line| line.join(" ") + "\n").collect()
}

/// Changes what the parser of numbers does not know: lines that end with CR alone, and the NaN of Microsoft's library.
fn readable<'b>(body: &'b [u8], end: &[u8]) -> Cow<'b, [u8]> {
    if end != b"\r" && !body.iter().any(is_odd) {
        return Cow::Borrowed(body);
    }
    let mut changed = Vec::with_capacity(body.len());
    for word in body.split_inclusive(u8::is_ascii_whitespace) {
        let (number, space) = word.split_at(word.trim_ascii_end().len());
        let is_no_number = number.iter().any(is_odd);
        changed.extend_from_slice(if is_no_number { b"nan" } else { number });
        changed.extend(space.iter().map(|&byte| if byte == b'\r' { b'\n' } else { byte }));
    }
    Cow::Owned(changed)
}

/// Returns whether a byte is part of Microsoft's NaN, as in `1.#IND` and `-nan(ind)`.
fn is_odd(byte: &u8) -> bool {
    matches!(byte, b'#' | b'(')
}

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
    let with_corners = ["face", "tristrips"].map(|name| header.get_element(name).filter(|element| element.count > 0));
    if with_corners.iter().all(Option::is_none) {
        return Err(Fault::unsupported("file", "point clouds: it has no faces, so no surface"));
    }
    let has_corners = with_corners.into_iter().flatten().all(|element| element.has_property("vertex_indices"));
    if !has_position || !has_corners {
        return Err(Fault::malformed("header", "vertex needs x, y, z, and face needs vertex_indices"));
    }
    Ok(())
}

/// The encoding of an element's colours.
pub(super) fn color_range(element: &ElementDef) -> ColorRange {
    match element.get_property("red").map(|p| &p.property_type) {
        Some(PropertyType::Scalar(ScalarType::F32 | ScalarType::F64)) => ColorRange::Floats,
        Some(PropertyType::Scalar(ScalarType::U16)) => ColorRange::Words,
        Some(PropertyType::Scalar(_)) => ColorRange::Bytes,
        _ => ColorRange::None,
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
