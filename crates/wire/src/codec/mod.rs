//! How depth images and frames become bytes, and bytes in chunks.
//!
//! `quantise`, `runs` and `tagged` are the pieces; `depth_codec`, `color_codec` and `words_codec` make
//! planes of them; `image_codec` puts planes together and `chunk` cuts the result for the wire.
//! `frame_codec` is for what clients are shown.
//!
//! All decoders trust nothing: sizes follow from a validated header, are held against [`DecodeLimits`],
//! and only then is memory taken.

mod chunk;
mod color_codec;
mod depth_codec;
mod depth_plane;
mod error;
mod frame_codec;
mod frame_planes;
mod image_codec;
mod image_header;
mod jpeg;
mod quantise;
mod reassembler;
mod rgb_filter;
mod runs;
mod tagged;
#[cfg(test)]
mod test_planes;
mod words_codec;

pub use chunk::{Chunk, ChunkBody, MAX_CHUNK_BYTES, SampleSetId, split_into_chunks};
pub use depth_plane::{EncodedDepthPlane, decode_depth_plane, encode_depth_plane, inverse_depth_codes};
pub use error::{DecodeError, DecodeLimits};
pub use frame_codec::{EncodedFrame, FrameCodec, FrameError, ParseFrameCodecError, decode_frame, encode_frame};
pub use frame_planes::{pack_f32_plane, pack_u32_plane, unpack_f32_plane, unpack_u32_plane};
pub use image_codec::{EncodedDepthImage, decode_depth_image, encode_depth_image};
pub use image_header::{ImageHeader, PlaneEncoding, PlaneHeader, PlaneKind, PlaneSet};
pub use quantise::{BACKGROUND_CODE, FIRST_SAMPLE_CODE, HOLE_CODE, InverseDepthRange};
pub use reassembler::{ChunkError, Reassembled, Reassembler};
