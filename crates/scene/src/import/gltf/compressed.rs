//! `EXT_meshopt_compression`, and its successor `KHR_meshopt_compression`: buffer views whose bytes are compressed.
//!
//! `meshoptimizer-rs` decodes. It is a port of the reference without unsafe code, and checks every read of a stream.

use gltf::json::buffer::{Buffer, View};
use gltf::json::{Root, Value};
use meshoptimizer_rs::codec::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer,
    decode_index_sequence, decode_vertex_buffer,
};
use meshoptimizer_rs::{Error, Limits, Workspace};
use serde::Deserialize;

use super::parsed;
use crate::{Fault, at_most};

/// The names of the extension. Their JSON is the same.
pub(super) const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Returns whether `buffer` only stands for decoded bytes. It may have no data, and is never read.
pub(super) fn is_fallback(buffer: &Buffer) -> bool {
    let others = buffer.extensions.as_ref().map(|extensions| &extensions.others);
    let extension = NAMES.iter().find_map(|name| others?.get(*name));
    extension.and_then(|value| value.get("fallback")?.as_bool()).unwrap_or(false)
}

/// The decoded bytes of each buffer view that is compressed. All of them together count against the limit of a file,
/// before memory is allocated. `range` gives a range of a buffer.
pub(super) fn decode_all<'a>(
    root: &Root,
    limit_bytes: u64,
    range: impl Fn(u64, u64, u64) -> Option<&'a [u8]>,
) -> Result<Vec<Option<Vec<u8>>>, Fault> {
    let mut decoded_bytes = 0u64;
    let mut decoded = vec![None; root.buffer_views.len()];
    for (number, view) in root.buffer_views.iter().enumerate() {
        let others = view.extensions.as_ref().map(|extensions| &extensions.others);
        let extension = NAMES.into_iter().find_map(|name| Some((name, others?.get(name)?)));
        let Some((name, value)) = extension else { continue };
        let element = format!("buffer view {number}, {name}");
        let compressed = Compressed::of(value, view, &element)?;
        // The product is the view's length, as has been checked.
        decoded_bytes = decoded_bytes.saturating_add(compressed.count * compressed.byte_stride);
        at_most(format_args!("{element}: decoded views in bytes"), decoded_bytes, limit_bytes)?;
        let Compressed { buffer, byte_offset, byte_length, .. } = compressed;
        let Some(bytes) = range(buffer, byte_offset, byte_length) else {
            return Err(Fault::malformed(element, format!("its {byte_length} bytes leave buffer {buffer}")));
        };
        let bytes = compressed.decode(bytes, limit_bytes);
        decoded[number] = Some(bytes.map_err(|error| Fault::malformed(element, reason(error)))?);
    }
    Ok(decoded)
}

/// The extension's JSON.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: u64,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

impl Compressed {
    /// Checks the count, the stride and the filter, also against the view that is replaced.
    fn of(value: &Value, view: &View, element: &str) -> Result<Self, Fault> {
        let compressed: Self = parsed(value, element)?;
        let Self { byte_stride, count, mode, filter, .. } = compressed;
        let is_stride_valid = match mode {
            Mode::Attributes => byte_stride.is_multiple_of(4) && (4..=256).contains(&byte_stride),
            Mode::Triangles | Mode::Indices => matches!(byte_stride, 2 | 4),
        };
        let is_filter_valid = match filter {
            Filter::None => true,
            Filter::Octahedral | Filter::Color => mode == Mode::Attributes && matches!(byte_stride, 4 | 8),
            Filter::Quaternion => mode == Mode::Attributes && byte_stride == 8,
            Filter::Exponential => mode == Mode::Attributes,
        };
        let parent_stride = view.byte_stride.map(|stride| stride.0 as u64);
        let problem = if count == 0 {
            "count is 0".to_owned()
        } else if !is_stride_valid {
            format!("byteStride {byte_stride} does not suit its mode")
        } else if !is_filter_valid {
            format!("its filter does not suit its mode or byteStride {byte_stride}")
        } else if mode == Mode::Triangles && !count.is_multiple_of(3) {
            format!("count {count} is not of whole triangles")
        } else if count.checked_mul(byte_stride) != Some(view.byte_length.0) {
            format!("{count} elements of {byte_stride} bytes where the view has {} bytes", view.byte_length.0)
        } else if parent_stride.is_some_and(|stride| stride != byte_stride) {
            format!("byteStride {byte_stride} is not the view's")
        } else {
            return Ok(compressed);
        };
        Err(Fault::malformed(element, problem))
    }

    fn decode(&self, bytes: &[u8], limit_bytes: u64) -> Result<Vec<u8>, Error> {
        let (Ok(count), Ok(stride)) = (usize::try_from(self.count), usize::try_from(self.byte_stride)) else {
            return Err(Error::SizeOverflow);
        };
        let max_bytes = usize::try_from(limit_bytes).unwrap_or(usize::MAX);
        let workspace = &mut Workspace::new(Limits { max_bytes, ..Limits::default() });
        let mut decoded = match self.mode {
            Mode::Attributes => decode_vertex_buffer(count, stride, bytes, workspace),
            Mode::Triangles => decode_index_buffer(count, stride, bytes, workspace),
            Mode::Indices => decode_index_sequence(count, stride, bytes, workspace),
        }?;
        match self.filter {
            Filter::None => Ok(()),
            Filter::Octahedral => decode_filter_oct(&mut decoded, count, stride, workspace),
            Filter::Quaternion => decode_filter_quat(&mut decoded, count, stride, workspace),
            Filter::Exponential => decode_filter_exp(&mut decoded, count, stride, workspace),
            Filter::Color => decode_filter_color(&mut decoded, count, stride, workspace),
        }?;
        Ok(decoded)
    }
}

fn reason(error: Error) -> String {
    match error {
        Error::InvalidStream => "its stream is cut off, damaged, or of another count or byteStride".to_owned(),
        Error::NumericalFailure => "its filter has no value for some element".to_owned(),
        other => other.to_string(),
    }
}
