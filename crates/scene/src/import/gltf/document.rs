//! A file with its buffers. Every range of an accessor is checked before it is read.

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::HashMap;

use data_url::DataUrl;
use gltf::json::accessor::{Accessor, ComponentType, sparse::Sparse};
use gltf::json::buffer::View;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::super::file_search::read_uri;
use super::super::folder::Folder;
use super::super::{Import, MissingTextures, Warnings};
use super::compressed;
use super::draco::{self, DecodedAccessor};
use crate::{Fault, Limits, SceneErrorKind, at_most};

/// The parsed JSON, the bytes of all buffers, and what else their reading takes.
pub(super) struct Document<'a> {
    pub root: &'a Root,
    pub limits: &'a Limits,
    pub missing_textures: MissingTextures,
    pub warnings: &'a Warnings,
    folder: &'a Folder,
    buffers: Vec<Cow<'a, [u8]>>,
    /// The bytes of each buffer view that is compressed in the file.
    decoded_views: Vec<Option<Vec<u8>>>,
    /// The accessors of primitives that are compressed in the file, by their numbers.
    decoded_accessors: HashMap<usize, DecodedAccessor>,
    /// A budget of elements to read. Primitives may share an accessor, so that a small file could otherwise expand
    /// without bound.
    elements_left: Cell<u64>,
}

impl<'a> Document<'a> {
    pub(super) fn open(root: &'a Root, binary_chunk: Option<&'a [u8]>, import: &'a Import) -> Result<Self, Fault> {
        let limits = import.limits;
        // Positions, normals, tangents, two pairs of coordinates, colours, joints, weights: eight elements a vertex, and four of
        // further joints; three indices a triangle.
        let of_triangles = limits.triangles.saturating_mul(3);
        let elements = limits.vertices.saturating_mul(12).saturating_add(of_triangles).saturating_add(limits.keys);
        let mut document = Self {
            root,
            limits,
            missing_textures: import.options.missing_textures,
            warnings: &import.warnings,
            folder: &import.folder,
            buffers: Vec::new(),
            decoded_views: Vec::new(),
            decoded_accessors: HashMap::new(),
            elements_left: Cell::new(elements),
        };
        document.read_buffers(binary_chunk)?;
        document.decoded_views = compressed::decode_all(root, limits.file_bytes, |buffer, offset, length| {
            document.buffer_range(buffer, offset, length)
        })?;
        document.decoded_accessors =
            draco::decode_all(root, limits, |view, element| Ok(document.view(view, element)?.1))?;
        Ok(document)
    }

    fn read_buffers(&mut self, binary_chunk: Option<&'a [u8]>) -> Result<(), Fault> {
        for (number, buffer) in self.root.buffers.iter().enumerate() {
            let element = format!("buffer {number}");
            if compressed::is_fallback(buffer) {
                self.buffers.push(Cow::default());
                continue;
            }
            let bytes: Cow<[u8]> = match (&buffer.uri, binary_chunk) {
                (Some(uri), _) => match self.read_uri(&element, uri)? {
                    Some(bytes) => bytes.into(),
                    None => return Err(Fault::new(element, SceneErrorKind::MissingFiles(vec![uri.clone()]))),
                },
                (None, Some(chunk)) if number == 0 => chunk.into(),
                (None, _) => return Err(Fault::malformed(element, "it has neither a uri nor a binary chunk")),
            };
            if (bytes.len() as u64) < buffer.byte_length.0 {
                let claim = format!("it claims {} bytes and has {}", buffer.byte_length.0, bytes.len());
                return Err(Fault::malformed(element, claim));
            }
            self.buffers.push(bytes);
        }
        Ok(())
    }

    /// Reads a `data:` URI or a file of the scene's folder; `None` for a file that does not exist.
    pub(super) fn read_uri(&self, element: &str, uri: &str) -> Result<Option<Vec<u8>>, Fault> {
        if !uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
            return read_uri(self.folder, element, uri);
        }
        let url = DataUrl::process(uri).map_err(|e| Fault::malformed(element, format!("data URI: {e:?}")))?;
        let (bytes, _) = url.decode_to_vec().map_err(|e| Fault::malformed(element, format!("data URI: {e:?}")))?;
        Ok(Some(bytes))
    }

    /// A range of a buffer.
    fn buffer_range(&self, buffer: u64, offset: u64, length: u64) -> Option<&[u8]> {
        slice_of(self.buffers.get(usize::try_from(buffer).ok()?)?, offset, length)
    }

    /// A buffer view and its bytes.
    pub(super) fn view(&self, index: Index<View>, element: &str) -> Result<(&View, &[u8]), Fault> {
        let wrong = |reason: String| Fault::malformed(format!("{element}, buffer view {}", index.value()), reason);
        let view = self.root.get(index).ok_or_else(|| wrong("it does not exist".into()))?;
        if let Some(Some(decoded)) = self.decoded_views.get(index.value()) {
            return Ok((view, decoded));
        }
        let buffer = view.buffer.value();
        let bytes = self.buffers.get(buffer).ok_or_else(|| wrong(format!("buffer {buffer} does not exist")))?;
        let range = slice_of(bytes, view.byte_offset.map_or(0, |o| o.0), view.byte_length.0);
        let range = range.ok_or_else(|| wrong(format!("it leaves the {} bytes of buffer {buffer}", bytes.len())))?;
        Ok((view, range))
    }

    /// `count` elements of `size` bytes in a buffer view, from `offset` on. Fails where the last one leaves the view.
    fn chunks(
        &self,
        view: Index<View>,
        offset: u64,
        count: u64,
        size: usize,
        name: &str,
    ) -> Result<impl Iterator<Item = &[u8]> + use<'_>, Fault> {
        let (view, bytes) = self.view(view, name)?;
        let stride = view.byte_stride.map_or(size, |s| s.0);
        let length = (stride as u64).checked_mul(count - 1).and_then(|l| l.checked_add(size as u64));
        match length.and_then(|length| slice_of(bytes, offset, length)) {
            Some(range) if stride >= size => {
                Ok((0..count as usize).map(move |i| &range[i * stride..i * stride + size]))
            }
            Some(_) => Err(Fault::malformed(name, format!("stride {stride} is less than {size} bytes"))),
            None => Err(Fault::malformed(name, format!("{count} elements leave a view of {} bytes", bytes.len()))),
        }
    }

    /// An accessor's elements as `N` floats each; integers are scaled to 0…1 or -1…1 where `normalized`.
    pub(super) fn floats<const N: usize>(&self, index: Index<Accessor>, element: &str) -> Result<Vec<[f32; N]>, Fault> {
        let layout = self.layout(index, element)?;
        if layout.components != N {
            return Err(layout.wrong(format!("it has {} components where {N} are needed", layout.components)));
        }
        let component = layout.component;
        let normalized = layout.accessor.normalized;
        self.elements(&layout, [0.0; N], |bytes| {
            let size = component.size();
            std::array::from_fn(|i| float(&bytes[i * size..(i + 1) * size], component, normalized))
        })
    }

    /// Whether the accessor's primitive is compressed in the file.
    pub(super) fn is_decoded(&self, index: Index<Accessor>) -> bool {
        self.decoded_accessors.contains_key(&index.value())
    }

    /// An accessor's elements as vertex numbers.
    pub(super) fn indices(&self, index: Index<Accessor>, element: &str) -> Result<Vec<u32>, Fault> {
        let layout = self.layout(index, element)?;
        let is_unsigned = matches!(layout.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if layout.components != 1 || !is_unsigned {
            return Err(layout.wrong("indices must be unsigned scalars".into()));
        }
        self.elements(&layout, 0, unsigned)
    }

    /// An accessor's description, before its elements are read.
    pub(super) fn layout(&self, index: Index<Accessor>, element: &str) -> Result<Layout<'_>, Fault> {
        let name = format!("{element}, accessor {}", index.value());
        let accessor = self.root.get(index).ok_or_else(|| Fault::malformed(&name, "it does not exist"))?;
        let (Checked::Valid(component), Checked::Valid(shape)) = (accessor.component_type, accessor.type_) else {
            return Err(Fault::malformed(name, "unknown component type or type"));
        };
        let decoded = self.decoded_accessors.get(&index.value());
        let (component, components) =
            decoded.map_or((component.0, shape.multiplicity()), |decoded| (decoded.component, decoded.components));
        let decoded = decoded.map(|decoded| &*decoded.bytes);
        let element_bytes = components * component.size();
        let count = decoded.map_or(accessor.count.0, |bytes| (bytes.len() / element_bytes.max(1)) as u64);
        if count == 0 {
            return Err(Fault::malformed(name, "it has no elements"));
        }
        at_most(&name, count, self.elements_left.get())?;
        Ok(Layout { name, accessor, component, components, count, decoded })
    }

    fn elements<T: Copy>(&self, layout: &Layout, zero: T, read: impl Fn(&[u8]) -> T) -> Result<Vec<T>, Fault> {
        self.elements_left.set(self.elements_left.get().saturating_sub(layout.count));
        if let Some(bytes) = layout.decoded {
            return Ok(bytes.chunks_exact(layout.element_bytes()).map(read).collect());
        }
        let mut elements: Vec<T> = match layout.accessor.buffer_view {
            Some(view) => {
                let offset = layout.accessor.byte_offset.map_or(0, |o| o.0);
                let chunks = self.chunks(view, offset, layout.count, layout.element_bytes(), &layout.name)?;
                chunks.map(&read).collect()
            }
            // An accessor without a view holds zeros. No byte of the file backs its count, so the file's size bounds it
            // instead.
            None => {
                let decoded = self.decoded_views.iter().flatten().map(Vec::len);
                let backed = self.buffers.iter().map(|b| b.len()).chain(decoded).map(|bytes| bytes as u64).sum();
                at_most(format!("{}, elements without data", layout.name), layout.count, backed)?;
                vec![zero; layout.count as usize]
            }
        };
        let Some(Sparse { count, indices, values, .. }) = &layout.accessor.sparse else { return Ok(elements) };
        let Checked::Valid(index_type) = indices.component_type else {
            return Err(layout.wrong("unknown type of sparse indices".into()));
        };
        let count = count.0;
        if count == 0 || count > layout.count {
            return Err(layout.wrong(format!("{count} sparse elements of {}", layout.count)));
        }
        let size = index_type.0.size();
        let places = self.chunks(indices.buffer_view, indices.byte_offset.0, count, size, &layout.name)?;
        let size = layout.element_bytes();
        let values = self.chunks(values.buffer_view, values.byte_offset.0, count, size, &layout.name)?;
        for (place, value) in places.zip(values) {
            let place = unsigned(place) as usize;
            let slot = elements.get_mut(place);
            *slot.ok_or_else(|| layout.wrong(format!("sparse index {place} is out of range")))? = read(value);
        }
        Ok(elements)
    }
}

/// An accessor's description with checked types.
pub(super) struct Layout<'a> {
    name: String,
    pub accessor: &'a Accessor,
    pub component: ComponentType,
    pub components: usize,
    pub count: u64,
    /// Its elements, packed, where they are compressed in the file.
    decoded: Option<&'a [u8]>,
}

impl Layout<'_> {
    fn wrong(&self, reason: String) -> Fault {
        Fault::malformed(&self.name, reason)
    }

    fn element_bytes(&self) -> usize {
        self.components * self.component.size()
    }
}

fn slice_of(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(start..end)
}

/// The elements of an attribute, as many as there are positions.
pub(super) fn same_count<T>(items: Vec<T>, needs: usize, what: &str, element: &str) -> Result<Vec<T>, Fault> {
    if items.len() != needs {
        return Err(Fault::malformed(element, format!("{what} has {} elements, POSITION {needs}", items.len())));
    }
    Ok(items)
}

/// Reads one component, little-endian; `bytes` has the component's length.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

fn float(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let bits = unsigned(bytes);
    let (value, largest) = match component {
        ComponentType::F32 => return f32::from_bits(bits),
        ComponentType::U8 => (bits as f32, 255.0),
        ComponentType::U16 => (bits as f32, 65_535.0),
        ComponentType::U32 => (bits as f32, u32::MAX as f32),
        ComponentType::I8 => (f32::from(bits as u8 as i8), 127.0),
        ComponentType::I16 => (f32::from(bits as u16 as i16), 32_767.0),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
