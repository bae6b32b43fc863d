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
    next_sequence: u32,
    chunk_count: u32,
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
        let result = self.accept(chunk);
        if result.is_err() {
            self.under_way = None;
        }
        result
    }

    /// A header of a later set may cut off an image; no other chunk may be out of turn.
    fn check_sequence(&mut self, chunk: &Chunk) -> Result<(), ChunkError> {
        let got = chunk.sequence;
        let Some(image) = &self.under_way else { return Ok(()) };
        let sample_set_id = image.sample_set_id;
        let image_index = image.image_index;
        let expected = image.next_sequence;
        if (chunk.sample_set_id, chunk.image_index) == (sample_set_id, image_index) && got <= expected {
            return if got == expected { Ok(()) } else { Err(ChunkError::Duplicate { got, expected }) };
        }
        self.under_way = None;
        if got == 0 && chunk.sample_set_id > sample_set_id {
            return Ok(());
        }
        Err(ChunkError::Missing { sample_set_id, image_index, got, expected })
    }

    fn accept(&mut self, chunk: Chunk) -> Result<Option<Reassembled>, ChunkError> {
        let Chunk { sample_set_id, image_index, sequence, chunk_count, .. } = chunk;
        if chunk.body.crc32() != chunk.crc32 {
            return Err(ChunkError::Checksum { sequence });
        }
        match (sequence, chunk.body, &mut self.under_way) {
            (0, ChunkBody::Header(header), under_way) => {
                check_header(&header, chunk_count, &self.limits)?;
                let pieces = Vec::new();
                *under_way =
                    Some(UnderWay { sample_set_id, image_index, next_sequence: 1, chunk_count, header, pieces });
            }
            (1.., ChunkBody::Data(data), Some(image)) => image.append(sequence, chunk_count, data)?,
            (1.., ChunkBody::Data(_), None) => return Err(ChunkError::NoHeader { image_index, got: sequence }),
            _ => return Err(ChunkError::Malformed { sequence, field: "body" }),
        }
        Ok(self.under_way.take_if(|image| image.next_sequence == image.chunk_count).map(UnderWay::finish))
    }
}

/// Checks the header against the limits before memory for the payload is allocated.
fn check_header(header: &ImageHeader, count: u32, limits: &DecodeLimits) -> Result<(), ChunkError> {
    header.validate(limits)?;
    if u64::from(count) == chunk_count(header.payload_bytes()) {
        return Ok(());
    }
    Err(ChunkError::Malformed { sequence: 0, field: "chunk_count" })
}

impl UnderWay {
    fn append(&mut self, sequence: u32, chunk_count: u32, data: Bytes) -> Result<(), ChunkError> {
        if chunk_count != self.chunk_count {
            return Err(ChunkError::Malformed { sequence, field: "chunk_count" });
        }
        let before = (u64::from(sequence) - 1) * MAX_CHUNK_BYTES as u64;
        let left = self.header.payload_bytes().saturating_sub(before);
        if data.len() as u64 != left.min(MAX_CHUNK_BYTES as u64) {
            return Err(ChunkError::Malformed { sequence, field: "data length" });
        }
        self.pieces.push(data);
        self.next_sequence += 1;
        Ok(())
    }

    fn finish(self) -> Reassembled {
        // A payload in one chunk is kept as it is.
        let payload = <[Bytes; 1]>::try_from(self.pieces).map_or_else(|pieces| pieces.concat().into(), |[whole]| whole);
        let image = EncodedImage { header: self.header, payload };
        Reassembled { sample_set_id: self.sample_set_id, image_index: self.image_index, image }
    }
}

#[cfg(test)]
#[path = "reassembler_tests.rs"]
mod tests;
