//! Encoded frames in pieces that fit a message, and back.

use bytes::Bytes;

use crate::FrameHeader;
use crate::chunk::MAX_CHUNK_BYTES;

/// A piece of an encoded frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FramePart {
    /// The client's number of the frame.
    pub frame: u64,
    /// On the first piece only.
    pub header: Option<FrameHeader>,
    /// Where the piece starts in the frame's data.
    pub offset_bytes: u64,
    /// The piece, at most [`MAX_CHUNK_BYTES`].
    pub data: Bytes,
}

impl FramePart {
    /// Cuts an encoded frame; no bytes are copied.
    pub fn cut(frame: u64, header: FrameHeader, encoded: Bytes) -> impl Iterator<Item = Self> {
        let mut header = Some(header);
        let starts = (0..encoded.len().max(1)).step_by(MAX_CHUNK_BYTES);
        starts.map(move |start| {
            let data = encoded.slice(start..encoded.len().min(start + MAX_CHUNK_BYTES));
            Self { frame, header: header.take(), offset_bytes: start as u64, data }
        })
    }
}

/// A frame whose parts have all come.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeFrame {
    /// The client's number of the frame.
    pub frame: u64,
    /// Its header.
    pub header: FrameHeader,
    /// All planes; their checksum has been verified.
    pub data: Bytes,
}

/// Why the parts of a stream make no frames.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum FrameAssemblyError {
    #[error("the header of the first part is missing")]
    NoHeader,
    #[error("frame {open} is cut off by frame {next}")]
    CutOff { open: u64, next: u64 },
    #[error("offset_bytes of frame {frame} is {offset_bytes}, must be {expected}")]
    Offset { frame: u64, offset_bytes: u64, expected: u64 },
    #[error("data of frame {frame} has {count} bytes, at most {limit} are allowed")]
    TooLong { frame: u64, count: u64, limit: u64 },
    #[error("the stream ends inside frame {frame}")]
    Truncated { frame: u64 },
    #[error("frame {frame} has another checksum than its header")]
    Checksum { frame: u64 },
}

/// Puts one stream's frames together: they come one after the other, parts in order.
#[derive(Debug, Default)]
pub struct FrameAssembly {
    open: Option<(u64, FrameHeader, Vec<u8>)>,
}

impl FrameAssembly {
    /// Adds a part; gives the frame that it completes.
    ///
    /// # Errors
    /// For parts out of order, repeated, beyond the announced size or with a wrong checksum.
    pub fn push(&mut self, part: FramePart) -> Result<Option<WholeFrame>, FrameAssemblyError> {
        let (frame, header, mut data) = match (self.open.take(), part.header) {
            (None, Some(header)) if part.data.len() as u64 == header.total_bytes() => {
                return whole(part.frame, header, part.data).map(Some);
            }
            (None, Some(header)) => (part.frame, header, Vec::new()),
            (Some((frame, header, data)), None) if frame == part.frame => (frame, header, data),
            (None, None) => return Err(FrameAssemblyError::NoHeader),
            (Some((open, ..)), _) => return Err(FrameAssemblyError::CutOff { open, next: part.frame }),
        };
        let expected = data.len() as u64;
        if part.offset_bytes != expected {
            return Err(FrameAssemblyError::Offset { frame, offset_bytes: part.offset_bytes, expected });
        }
        let count = expected + part.data.len() as u64;
        if count > header.total_bytes() {
            return Err(FrameAssemblyError::TooLong { frame, count, limit: header.total_bytes() });
        }
        data.extend_from_slice(&part.data);
        if count == header.total_bytes() {
            return whole(frame, header, data.into()).map(Some);
        }
        self.open = Some((frame, header, data));
        Ok(None)
    }

    /// Checks that the stream did not end inside a frame.
    ///
    /// # Errors
    /// Names the frame that is cut off.
    pub fn finish(&self) -> Result<(), FrameAssemblyError> {
        let open = self.open.as_ref();
        open.map_or(Ok(()), |&(frame, ..)| Err(FrameAssemblyError::Truncated { frame }))
    }
}

fn whole(frame: u64, header: FrameHeader, data: Bytes) -> Result<WholeFrame, FrameAssemblyError> {
    if crc32fast::hash(&data) == header.crc32 {
        Ok(WholeFrame { frame, header, data })
    } else {
        Err(FrameAssemblyError::Checksum { frame })
    }
}

#[cfg(test)]
#[path = "frame_parts_tests.rs"]
mod tests;
