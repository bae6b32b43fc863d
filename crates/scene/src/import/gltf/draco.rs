//! `KHR_draco_mesh_compression`: primitives whose attributes and triangles are one compressed stream.
//!
//! `draco-core` decodes. It is a port of the reference without unsafe code, and bounds what a stream decodes to. What it
//! decodes takes the place of the bytes that the primitive's accessors lack.

use std::collections::{BTreeMap, HashMap};

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex};
use gltf::json::accessor::{Accessor, ComponentType};
use gltf::json::buffer::View;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use serde::Deserialize;

use super::parsed;
use crate::{Fault, Limits, at_most};

/// The name of the extension.
pub(super) const NAME: &str = "KHR_draco_mesh_compression";

/// The elements of an accessor, packed; they count in place of the accessor's own type and count.
pub(super) struct DecodedAccessor {
    pub component: ComponentType,
    pub components: usize,
    pub bytes: Vec<u8>,
}

/// The extension's JSON.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer_view: Index<View>,
    /// The stream's numbers of the attributes, by the names of glTF.
    attributes: BTreeMap<String, u32>,
}

/// What all streams of a file have been decoded to, and what they may still decode to.
struct Streams {
    decoded: HashMap<usize, DecodedAccessor>,
    points_left: u64,
    faces_left: u64,
    bytes_left: u64,
}

/// The accessors of all compressed primitives, by their numbers. All streams together count against the limits. `view` gives
/// the bytes of a buffer view.
pub(super) fn decode_all<'a>(
    root: &Root,
    limits: &Limits,
    view: impl Fn(Index<View>, &str) -> Result<&'a [u8], Fault>,
) -> Result<HashMap<usize, DecodedAccessor>, Fault> {
    let mut streams = Streams {
        decoded: HashMap::new(),
        points_left: limits.vertices,
        faces_left: limits.triangles,
        bytes_left: limits.file_bytes,
    };
    for (number, mesh) in root.meshes.iter().enumerate() {
        for (part, primitive) in mesh.primitives.iter().enumerate() {
            let extension = primitive.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
            let Some(extension) = extension.filter(|_| is_needed(root, primitive, &streams.decoded)) else { continue };
            let element = format!("mesh {number}, primitive {part}, {NAME}");
            let compressed: Compressed = parsed(extension, &element)?;
            let mesh = streams.mesh(view(compressed.buffer_view, &element)?, &element)?;
            streams.add_accessors(primitive, &compressed, &mesh, &element)?;
        }
    }
    Ok(streams.decoded)
}

/// Whether a primitive has triangles and no uncompressed positions, and its accessors have not been decoded for another
/// primitive.
fn is_needed(root: &Root, primitive: &Primitive, decoded: &HashMap<usize, DecodedAccessor>) -> bool {
    let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let accessor: Option<&Accessor> = position.and_then(|&index| root.get(index));
    let is_uncompressed = accessor.is_some_and(|accessor| accessor.buffer_view.is_some());
    let mut accessors = primitive.attributes.values().chain(&primitive.indices);
    let has_triangles =
        matches!(primitive.mode, Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan));
    has_triangles && !is_uncompressed && !accessors.all(|index| decoded.contains_key(&index.value()))
}

impl Streams {
    fn mesh(&mut self, bytes: &[u8], element: &str) -> Result<Mesh, Fault> {
        let limits = DecodeLimits::default()
            .with_max_points(self.points_left)
            .with_max_faces(self.faces_left)
            .with_max_decoded_bytes(self.bytes_left);
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
        MeshDecoder::new()
            .decode(&mut buffer, &mut mesh)
            .map_err(|error| Fault::malformed(element, format!("its stream is cut off or damaged: {error}")))?;
        let points = mesh.num_points() as u64;
        let faces = mesh.num_faces() as u64;
        at_most(format_args!("{element}: decoded vertices"), points, self.points_left)?;
        at_most(format_args!("{element}: decoded triangles"), faces, self.faces_left)?;
        self.points_left -= points;
        self.faces_left -= faces;
        Ok(mesh)
    }

    fn add_accessors(
        &mut self,
        primitive: &Primitive,
        compressed: &Compressed,
        mesh: &Mesh,
        element: &str,
    ) -> Result<(), Fault> {
        let indices = primitive.indices.ok_or_else(|| Fault::malformed(element, "its primitive has no indices"))?;
        self.take_bytes(element, mesh.num_faces() as u64 * 12)?;
        let corners = mesh.faces().iter().flatten();
        let bytes = corners.flat_map(|corner| corner.0.to_le_bytes()).collect();
        self.decoded.insert(indices.value(), DecodedAccessor { component: ComponentType::U32, components: 1, bytes });
        for (semantic, accessor) in &primitive.attributes {
            let Checked::Valid(semantic) = semantic else { continue };
            let Some(&id) = compressed.attributes.get(&semantic.to_string()) else { continue };
            let Some(attribute) = mesh.attribute_by_unique_id(id) else {
                return Err(Fault::malformed(element, format!("{semantic:?} has number {id}, which its stream lacks")));
            };
            let packed = self.packed(attribute, mesh.num_points(), &format!("{element}, {semantic:?}"))?;
            self.decoded.insert(accessor.value(), packed);
        }
        Ok(())
    }

    /// The values of all points, one after another: a stream stores equal values once.
    fn packed(&mut self, attribute: &PointAttribute, points: usize, element: &str) -> Result<DecodedAccessor, Fault> {
        let component = match attribute.data_type() {
            DataType::Int8 => ComponentType::I8,
            DataType::Uint8 => ComponentType::U8,
            DataType::Int16 => ComponentType::I16,
            DataType::Uint16 => ComponentType::U16,
            DataType::Uint32 => ComponentType::U32,
            DataType::Float32 => ComponentType::F32,
            other => return Err(Fault::unsupported(element, format!("components of type {other:?}"))),
        };
        let components = usize::from(attribute.num_components());
        let size = components * component.size();
        self.take_bytes(element, (points as u64).saturating_mul(size as u64))?;
        let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0);
        let data = attribute.buffer().data();
        let mut bytes = Vec::with_capacity(points * size);
        for point in 0..points as u32 {
            let start = (attribute.mapped_index(PointIndex(point)).0 as usize).checked_mul(stride);
            let value = start.and_then(|start| data.get(start..start.checked_add(size)?));
            let Some(value) = value else {
                return Err(Fault::malformed(element, format!("its stream has no value for vertex {point}")));
            };
            bytes.extend_from_slice(value);
        }
        Ok(DecodedAccessor { component, components, bytes })
    }

    fn take_bytes(&mut self, element: &str, bytes: u64) -> Result<(), Fault> {
        at_most(format_args!("{element}: decoded attributes in bytes"), bytes, self.bytes_left)?;
        self.bytes_left -= bytes;
        Ok(())
    }
}
