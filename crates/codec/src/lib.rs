//! Depth images, views and frames as bytes, and those bytes in chunks.
//!
//! Planes: `quantise`, `runs` and `tagged` are the pieces; `depth_codec`, `color_codec` and `words_codec` make planes
//! of them. Depth images: `image_codec` puts planes together and `chunk` cuts the result. Views: `frame_codec` packs the
//! colour, `view_codec` adds the other planes, and `frame_parts` cuts the result.
//!
//! Decoders trust nothing: sizes follow from a validated header and are checked against [`DecodeLimits`] before memory is
//! taken.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod chunk;
mod color_codec;
mod depth_codec;
mod error;
mod frame_codec;
mod frame_header;
mod frame_parts;
mod image_codec;
mod image_header;
mod layered_codec;
mod layered_image_codec;
mod lz4;
mod quantise;
mod reassembler;
mod runs;
mod sample_image_codec;
mod tagged;
#[cfg(test)]
mod test_support;
mod view_codec;
mod words_codec;

pub use chunk::{Chunk, ChunkBody, MAX_CHUNK_BYTES, SampleSetId, split_into_chunks};
pub use error::{DecodeError, DecodeLimits, FrameError};
pub use frame_codec::{FrameCodec, ParseFrameCodecError, decode_frame, encode_frame};
pub use frame_header::{FrameHeader, MAX_FRAME_BYTES, StageTimes};
pub use frame_parts::{FrameAssembly, FrameAssemblyError, FramePart, WholeFrame};
pub use image_codec::{EncodedImage, decode_depth_image, encode_depth_image};
pub use image_header::{
    ImageHeader, LayeredCounts, MAX_LIGHT_SHARE_PLANES, MAX_VISIBILITY_PLANES, PlaneEncoding, PlaneHeader, PlaneKind,
};
pub use layered_image_codec::{decode_layered_image, decode_light_field, encode_layered_image, encode_light_field};
pub use quantise::InverseDepthRange;
pub use reassembler::{ChunkError, Reassembled, Reassembler};
pub use sample_image_codec::{decode_sample_image, encode_sample_image};
pub use view_codec::{EncodedView, decode_view, encode_view};
