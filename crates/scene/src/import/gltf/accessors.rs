//! Typed arrays in buffers, every range checked before it is read.

use std::cell::Cell;

use data_url::DataUrl;
use gltf::json::accessor::{Accessor, ComponentType, Type, sparse::Sparse};
use gltf::json::buffer::View;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::super::folder::Folder;
use crate::Limits;
use crate::error::{Fault, at_most};

/// The bytes of all buffers, and a budget of bytes to read. Primitives may share an accessor, so that a small file
/// could otherwise expand without bound.
pub(super) struct Buffers<'a> {
    contents: Vec<std::borrow::Cow<'a, [u8]>>,
    elements_left: Cell<u64>,
}

impl<'a> Buffers<'a> {
    pub(super) fn load(
        root: &Root,
        binary_chunk: Option<&'a [u8]>,
        folder: &Folder,
        limits: &Limits,
    ) -> Result<Self, Fault> {
        let mut contents = Vec::new();
        for (number, buffer) in root.buffers.iter().enumerate() {
            let element = format!("buffer {number}");
            let bytes: std::borrow::Cow<[u8]> = match (&buffer.uri, binary_chunk) {
                (Some(uri), _) => read_uri(&element, uri, folder)?.into(),
                (None, Some(chunk)) if number == 0 => chunk.into(),
                (None, _) => {
                    return Err(Fault::malformed(element, "it has neither a uri nor a binary chunk"));
                }
            };
            if (bytes.len() as u64) < buffer.byte_length.0 {
                let claim = format!("it claims {} bytes and has {}", buffer.byte_length.0, bytes.len());
                return Err(Fault::malformed(element, claim));
            }
            contents.push(bytes);
        }
        // Positions, normals, coordinates, colours: four elements a vertex; three indices a triangle.
        let elements = limits.vertices.saturating_mul(4).saturating_add(limits.triangles.saturating_mul(3));
        Ok(Self { contents, elements_left: Cell::new(elements) })
    }

    /// The bytes of a buffer view.
    pub(super) fn view<'s>(
        &'s self,
        root: &'s Root,
        index: Index<View>,
        element: &str,
    ) -> Result<ViewBytes<'s>, Fault> {
        let wrong = |reason: String| Fault::malformed(format!("{element}, buffer view {}", index.value()), reason);
        let view = root.get(index).ok_or_else(|| wrong("it does not exist".into()))?;
        let buffer = view.buffer.value();
        let bytes = self.contents.get(buffer).ok_or_else(|| wrong(format!("buffer {buffer} does not exist")))?;
        let offset = view.byte_offset.map_or(0, |o| o.0);
        let range = slice_of(bytes, offset, view.byte_length.0);
        let bytes = range.ok_or_else(|| wrong(format!("it leaves the {} bytes of buffer {buffer}", bytes.len())))?;
        Ok(ViewBytes { bytes, stride: view.byte_stride.map(|s| s.0) })
    }

    /// An accessor's elements as `N` floats each; integers are scaled to 0…1 or -1…1 where `normalized`.
    pub(super) fn floats<const N: usize>(
        &self,
        root: &Root,
        index: Index<Accessor>,
        element: &str,
    ) -> Result<Vec<[f32; N]>, Fault> {
        let layout = self.layout(root, index, element)?;
        if layout.components != N {
            return Err(layout.wrong(format!("it has {} components where {N} are needed", layout.components)));
        }
        let normalized = layout.accessor.normalized;
        let read = |bytes: &[u8]| component_array(bytes, layout.component, normalized);
        self.elements(root, &layout, [0.0; N], read)
    }

    /// Components of an accessor: 3 or 4 for colours.
    pub(super) fn component_count(&self, root: &Root, index: Index<Accessor>, element: &str) -> Result<usize, Fault> {
        Ok(self.layout(root, index, element)?.components)
    }

    /// An accessor's elements as vertex numbers.
    pub(super) fn indices(&self, root: &Root, index: Index<Accessor>, element: &str) -> Result<Vec<u32>, Fault> {
        let layout = self.layout(root, index, element)?;
        if layout.components != 1 || !is_index_type(layout.component) {
            return Err(layout.wrong("indices must be unsigned scalars".into()));
        }
        self.elements(root, &layout, 0, |bytes| unsigned(bytes, layout.component))
    }

    fn layout<'s>(&'s self, root: &'s Root, index: Index<Accessor>, element: &str) -> Result<Layout<'s>, Fault> {
        let name = format!("{element}, accessor {}", index.value());
        let accessor = root.get(index).ok_or_else(|| Fault::malformed(&name, "it does not exist"))?;
        let (Checked::Valid(component), Checked::Valid(shape)) = (accessor.component_type, accessor.type_) else {
            return Err(Fault::malformed(name, "unknown component type or type"));
        };
        let components = component_count_of(shape);
        let count = accessor.count.0;
        if count == 0 {
            return Err(Fault::malformed(name, "it has no elements"));
        }
        at_most(&name, count, self.elements_left.get())?;
        Ok(Layout { name, accessor, component: component.0, components, count })
    }

    fn elements<T: Copy>(
        &self,
        root: &Root,
        layout: &Layout,
        zero: T,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Fault> {
        let element_bytes = layout.components * component_bytes(layout.component);
        self.elements_left.set(self.elements_left.get().saturating_sub(layout.count));
        let mut elements = match layout.accessor.buffer_view {
            Some(view) => {
                let offset = layout.accessor.byte_offset.map_or(0, |o| o.0);
                let view = self.view(root, view, &layout.name)?;
                let chunks = view.chunks(offset, layout.count, element_bytes, &layout.name)?;
                chunks.map(&read).collect()
            }
            None => self.zeros(layout, zero)?,
        };
        if let Some(sparse) = &layout.accessor.sparse {
            self.overwrite(root, layout, sparse, element_bytes, &mut elements, read)?;
        }
        Ok(elements)
    }

    /// An accessor without a view holds zeros. No byte of the file backs its count, so the file's size bounds it
    /// instead.
    fn zeros<T: Copy>(&self, layout: &Layout, zero: T) -> Result<Vec<T>, Fault> {
        let backed = self.contents.iter().map(|c| c.len() as u64).sum();
        at_most(format!("{}, elements without data", layout.name), layout.count, backed)?;
        Ok(vec![zero; layout.count as usize])
    }

    fn overwrite<T>(
        &self,
        root: &Root,
        layout: &Layout,
        sparse: &Sparse,
        element_bytes: usize,
        elements: &mut [T],
        read: impl Fn(&[u8]) -> T,
    ) -> Result<(), Fault> {
        let Checked::Valid(index_type) = sparse.indices.component_type else {
            return Err(layout.wrong("unknown type of sparse indices".into()));
        };
        let count = sparse.count.0;
        if count == 0 || count > layout.count {
            return Err(layout.wrong(format!("{count} sparse elements of {}", layout.count)));
        }
        let places = self.view(root, sparse.indices.buffer_view, &layout.name)?;
        let places = places.chunks(sparse.indices.byte_offset.0, count, component_bytes(index_type.0), &layout.name)?;
        let values = self.view(root, sparse.values.buffer_view, &layout.name)?;
        let values = values.chunks(sparse.values.byte_offset.0, count, element_bytes, &layout.name)?;
        for (place, value) in places.zip(values) {
            let place = unsigned(place, index_type.0) as usize;
            let slot = elements.get_mut(place);
            *slot.ok_or_else(|| layout.wrong(format!("sparse index {place} is out of range")))? = read(value);
        }
        Ok(())
    }
}

/// Reads a `data:` URI or a file of the scene's folder.
pub(super) fn read_uri(element: &str, uri: &str, folder: &Folder) -> Result<Vec<u8>, Fault> {
    if !uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        return folder.read_uri(element, uri);
    }
    let url = DataUrl::process(uri).map_err(|e| Fault::malformed(element, format!("data URI: {e:?}")))?;
    let (bytes, _) = url.decode_to_vec().map_err(|e| Fault::malformed(element, format!("data URI: {e:?}")))?;
    Ok(bytes)
}

/// An accessor's description with checked types.
struct Layout<'a> {
    name: String,
    accessor: &'a Accessor,
    component: ComponentType,
    components: usize,
    count: u64,
}

impl Layout<'_> {
    fn wrong(&self, reason: String) -> Fault {
        Fault::malformed(&self.name, reason)
    }
}

pub(super) struct ViewBytes<'a> {
    pub bytes: &'a [u8],
    stride: Option<usize>,
}

impl<'a> ViewBytes<'a> {
    /// `count` elements of `element_bytes` from `offset` on. Fails where the last one leaves the view.
    fn chunks(
        &self,
        offset: u64,
        count: u64,
        element_bytes: usize,
        name: &str,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, Fault> {
        let stride = self.stride.unwrap_or(element_bytes);
        let length = (stride as u64).checked_mul(count - 1).and_then(|l| l.checked_add(element_bytes as u64));
        let range = length.and_then(|length| slice_of(self.bytes, offset, length));
        match range {
            Some(range) if stride >= element_bytes => {
                Ok((0..count as usize).map(move |i| &range[i * stride..i * stride + element_bytes]))
            }
            Some(_) => Err(Fault::malformed(name, format!("stride {stride} is less than {element_bytes} bytes"))),
            None => Err(Fault::malformed(name, format!("{count} elements leave a view of {} bytes", self.bytes.len()))),
        }
    }
}

fn slice_of(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(start..end)
}

fn component_count_of(shape: Type) -> usize {
    match shape {
        Type::Scalar => 1,
        Type::Vec2 => 2,
        Type::Vec3 => 3,
        Type::Vec4 | Type::Mat2 => 4,
        Type::Mat3 => 9,
        Type::Mat4 => 16,
    }
}

fn component_bytes(component: ComponentType) -> usize {
    match component {
        ComponentType::I8 | ComponentType::U8 => 1,
        ComponentType::I16 | ComponentType::U16 => 2,
        ComponentType::U32 | ComponentType::F32 => 4,
    }
}

fn is_index_type(component: ComponentType) -> bool {
    matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
}

/// Reads one component; `bytes` has the component's length.
fn unsigned(bytes: &[u8], component: ComponentType) -> u32 {
    match component {
        ComponentType::I8 | ComponentType::U8 => u32::from(bytes[0]),
        ComponentType::I16 | ComponentType::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        ComponentType::U32 | ComponentType::F32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

fn component_array<const N: usize>(bytes: &[u8], component: ComponentType, normalized: bool) -> [f32; N] {
    let size = component_bytes(component);
    std::array::from_fn(|i| float(&bytes[i * size..(i + 1) * size], component, normalized))
}

fn float(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let bits = unsigned(bytes, component);
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
