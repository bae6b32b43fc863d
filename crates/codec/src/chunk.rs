//! Encoded images in pieces that fit a message: the header first, then the payload in order.

use std::fmt;

use bytes::Bytes;

use crate::{EncodedImage, ImageHeader};

/// Data of one chunk; the last of an image may have less.
pub const MAX_CHUNK_BYTES: usize = 512 << 10;

/// Names scene time, cameras and lighting of a set of sample images. Later sets compare greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct SampleSetId {
    /// The plan that asked for it.
    pub plan_epoch: u64,
    /// Counts the sets of one plan.
    pub index: u64,
}

impl fmt::Display for SampleSetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.plan_epoch, self.index)
    }
}

/// The body of a chunk.
#[derive(Debug, Clone, PartialEq)]
pub enum ChunkBody {
    /// The body of sequence 0.
    Header(ImageHeader),
    /// A piece of the payload, at most [`MAX_CHUNK_BYTES`].
    Data(Bytes),
}

/// One piece of an encoded depth image.
#[derive(Debug, Clone, PartialEq)]
pub struct Chunk {
    /// The set that the image belongs to.
    pub sample_set_id: SampleSetId,
    /// Index of the image in the set.
    pub image_index: u32,
    /// 0 for the header, then one more for each piece.
    pub sequence: u32,
    /// Chunks of this image, the header's included.
    pub chunk_count: u32,
    /// CRC-32 of the body.
    pub crc32: u32,
    /// Header or data.
    pub body: ChunkBody,
}

impl Chunk {
    /// Bytes of data; a header has none.
    #[must_use]
    pub fn data_len(&self) -> usize {
        match &self.body {
            ChunkBody::Header(_) => 0,
            ChunkBody::Data(data) => data.len(),
        }
    }
}

impl ChunkBody {
    /// The checksum that a chunk with this body carries.
    #[must_use]
    pub fn crc32(&self) -> u32 {
        match self {
            Self::Header(header) => header.crc32(),
            Self::Data(data) => crc32fast::hash(data),
        }
    }
}

/// Chunks of an image whose payload has `payload_bytes`, the header's included.
pub(crate) fn chunk_count(payload_bytes: u64) -> u64 {
    1 + payload_bytes.div_ceil(MAX_CHUNK_BYTES as u64)
}

/// The chunks of an image, in the order in which they must be sent. The payload is shared, not copied.
pub fn split_into_chunks(
    sample_set_id: SampleSetId,
    image_index: u32,
    image: EncodedImage,
) -> impl Iterator<Item = Chunk> {
    let EncodedImage { header, payload } = image;
    let chunk_count = chunk_count(payload.len() as u64) as u32;
    let starts = (0..payload.len()).step_by(MAX_CHUNK_BYTES);
    let pieces = starts.map(move |start| payload.slice(start..payload.len().min(start + MAX_CHUNK_BYTES)));
    let bodies = std::iter::once(ChunkBody::Header(header)).chain(pieces.map(ChunkBody::Data));
    (0..).zip(bodies).map(move |(sequence, body)| Chunk {
        sample_set_id,
        image_index,
        sequence,
        chunk_count,
        crc32: body.crc32(),
        body,
    })
}
