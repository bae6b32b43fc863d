//! Uniforms of many elements, of which each dispatch or draw sees one at a dynamic offset.

/// Dynamic offsets are multiples of this on every device.
const ALIGNMENT_BYTES: u32 = 256;

/// The bytes from one element to the next.
#[must_use]
pub const fn uniform_stride(element_bytes: u32) -> u32 {
    element_bytes.next_multiple_of(ALIGNMENT_BYTES)
}

/// Elements of one size, each at its dynamic offset.
#[must_use]
pub fn uniform_elements<E: AsRef<[u8]>>(elements: impl IntoIterator<Item = E>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for element in elements {
        bytes.extend_from_slice(element.as_ref());
        bytes.resize(bytes.len().next_multiple_of(ALIGNMENT_BYTES as usize), 0);
    }
    bytes
}
