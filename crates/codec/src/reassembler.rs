//! Chunks back to images. One reassembler serves one stream, one image at a time.

use bytes::Bytes;

use crate::chunk::chunk_count;
use crate::{Chunk, ChunkBody, DecodeError, DecodeLimits, EncodedImage, ImageHeader, MAX_CHUNK_BYTES, SampleSetId};

/// An image whose chunks have all arrived.
#[derive(Debug, Clone, PartialEq)]
pub struct Reassembled {
    /// The set it belongs to.
    pub sample_set_id: SampleSetId,
    /// Index of the image in the set.
    pub image_index: u32,
    /// The image; its header has passed [`ImageHeader::validate`].
    pub image: EncodedImage,
}

/// Why a chunk is refused. An incomplete image is dropped, unless the chunk was stale or a duplicate.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum ChunkError {
    /// The chunk is of a set before those that are wanted.
    #[error("chunk of sample set {got}, older than {oldest}")]
    StaleSet { got: SampleSetId, oldest: SampleSetId },
    /// The chunk has arrived before.
    #[error("chunk {got} again, chunk {expected} is next")]
    Duplicate { got: u32, expected: u32 },
    /// Chunks were lost or overtaken.
    #[error("chunk {got} of image {image_index} in sample set {sample_set_id}, but chunk {expected} is missing")]
    Missing { sample_set_id: SampleSetId, image_index: u32, got: u32, expected: u32 },
    /// Data arrived without the header of its image.
    #[error("chunk {got} of image {image_index} without a header")]
    NoHeader { image_index: u32, got: u32 },
    /// The body is of the wrong kind, size or count.
    #[error("chunk {sequence}: {field} is wrong")]
    Malformed { sequence: u32, field: &'static str },
    /// The body is not what was sent.
    #[error("chunk {sequence}: checksum does not match")]
    Checksum { sequence: u32 },
    /// The header is invalid, or over a limit.
    #[error(transparent)]
    Header(#[from] DecodeError),
}

/// Accepts the chunks of one stream in order.
#[derive(Debug)]
pub struct Reassembler {
    limits: DecodeLimits,
    oldest: SampleSetId,
    under_way: Option<UnderWay>,
}

#[derive(Debug)]
struct UnderWay {
    sample_set_id: SampleSetId,
    image_index: u32,
    header: ImageHeader,
    pieces: Vec<Bytes>,
}

impl Reassembler {
    /// Accepts sets from `oldest` on, and images within `limits`.
    #[must_use]
    pub fn new(limits: DecodeLimits, oldest: SampleSetId) -> Self {
        Self { limits, oldest, under_way: None }
    }

    /// Takes the next chunk; gives the image after its last.
    ///
    /// # Errors
    /// See [`ChunkError`].
    pub fn push(&mut self, chunk: Chunk) -> Result<Option<Reassembled>, ChunkError> {
        if chunk.sample_set_id < self.oldest {
            return Err(ChunkError::StaleSet { got: chunk.sample_set_id, oldest: self.oldest });
        }
        self.check_sequence(&chunk)?;
        self.accept(chunk)
    }

    /// A header of a later set may cut off an image; no other chunk may be out of turn.
    fn check_sequence(&mut self, chunk: &Chunk) -> Result<(), ChunkError> {
        let got = chunk.sequence;
        let Some(image) = &self.under_way else { return Ok(()) };
        let sample_set_id = image.sample_set_id;
        let image_index = image.image_index;
        let expected = image.pieces.len() as u32 + 1;
        if (chunk.sample_set_id, chunk.image_index) == (sample_set_id, image_index) && got <= expected {
            return if got == expected { Ok(()) } else { Err(ChunkError::Duplicate { got, expected }) };
        }
        self.under_way = None;
        if got == 0 && chunk.sample_set_id > sample_set_id {
            return Ok(());
        }
        Err(ChunkError::Missing { sample_set_id, image_index, got, expected })
    }

    /// Drops the image under way where the chunk is refused.
    fn accept(&mut self, chunk: Chunk) -> Result<Option<Reassembled>, ChunkError> {
        let Chunk { sample_set_id, image_index, sequence, .. } = chunk;
        let under_way = self.under_way.take();
        if chunk.body.crc32() != chunk.crc32 {
            return Err(ChunkError::Checksum { sequence });
        }
        let (mut image, data) = match (sequence, chunk.body, under_way) {
            (0, ChunkBody::Header(header), _) => {
                // Before memory for the payload is allocated.
                header.validate(&self.limits)?;
                (UnderWay { sample_set_id, image_index, header, pieces: Vec::new() }, None)
            }
            (1.., ChunkBody::Data(data), Some(image)) => (image, Some(data)),
            (1.., ChunkBody::Data(_), None) => return Err(ChunkError::NoHeader { image_index, got: sequence }),
            _ => return Err(ChunkError::Malformed { sequence, field: "body" }),
        };
        let payload_bytes = image.header.payload_bytes();
        if u64::from(chunk.chunk_count) != chunk_count(payload_bytes) {
            return Err(ChunkError::Malformed { sequence, field: "chunk_count" });
        }
        if let Some(data) = data {
            let left = payload_bytes.saturating_sub(image.pieces.len() as u64 * MAX_CHUNK_BYTES as u64);
            if data.len() as u64 != left.min(MAX_CHUNK_BYTES as u64) {
                return Err(ChunkError::Malformed { sequence, field: "data length" });
            }
            image.pieces.push(data);
        }
        if image.pieces.len() as u64 + 1 < chunk_count(payload_bytes) {
            self.under_way = Some(image);
            return Ok(None);
        }
        // A payload in one chunk is kept as it is.
        let payload = <[Bytes; 1]>::try_from(image.pieces);
        let payload = payload.map_or_else(|pieces| pieces.concat().into(), |[whole]| whole);
        let image = EncodedImage { header: image.header, payload };
        Ok(Some(Reassembled { sample_set_id, image_index, image }))
    }
}

#[cfg(test)]
#[path = "reassembler_tests.rs"]
mod tests;
