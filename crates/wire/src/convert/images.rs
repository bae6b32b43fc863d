//! Requests for sample images, and the chunks of these.

use cluster::{FetchImages, at_most};
use codec::{
    Chunk, ChunkBody, ImageHeader, LayeredCounts, MAX_CHUNK_BYTES, MAX_LIGHT_SHARE_PLANES, MAX_VISIBILITY_PLANES,
    PlaneEncoding, PlaneHeader, PlaneKind,
};

use super::{Convert, required};
use crate::error::WireError;
use crate::proto::{self, chunk::Body};

/// One plane of each kind that a depth image with colour may have, which has the most; visibility may have more.
const MAX_PLANES: usize = 7 + MAX_VISIBILITY_PLANES;

// Six planes of an image with light, and its shares.
const _: () = assert!(6 + MAX_LIGHT_SHARE_PLANES <= MAX_PLANES);

messages! {
    FetchSampleImagesRequest = FetchImages { plan_epoch, workload_number, set_index, image_indices; cell: cell_index },
        then FetchImages::validate;
    Chunk = Chunk {
        image_index, chunk_count, body as "chunk.body";
        sample_set_id: plan_epoch | set_index, sequence: sequence_number, crc32: body_crc32
    };
    ImageHeader = ImageHeader {
        planes, layered; width: width_px, height: height_px,
        inverse_depth_range: least_inverse_depth_per_m | greatest_inverse_depth_per_m
    }, first |h| at_most(h.planes.len(), MAX_PLANES, "header.planes");
    LayeredCounts = LayeredCounts { sample_count; truncated: is_truncated };
    PlaneHeader = PlaneHeader { kind as "planes.kind", encoding as "planes.encoding", raw_bytes, packed_bytes };
}

enums! {
    PlaneKind {
        InverseDepth, ColorRgb9e5, NormalOct16, SurfaceId, ReflectanceRoughness8, Visibility8, Passed1,
        CornerInverseDepth, LayerCount8, LayerDepth, PlaneNormalOct8, TriangleNormalOct16, LampsRgb9e5,
        EnvironmentRgb9e5, LightShare8
    }
    PlaneEncoding { SlopeTaggedLz4, DifferenceTaggedLz4, ChangeTaggedLz4, BitsLz4 }
}

impl Convert<proto::FetchSampleImagesResponse> for Chunk {
    fn read(response: proto::FetchSampleImagesResponse, _: &'static str) -> Result<Self, WireError> {
        Convert::read(response.chunk, "chunk")
    }

    fn write(self) -> proto::FetchSampleImagesResponse {
        proto::FetchSampleImagesResponse { chunk: self.write() }
    }
}

impl Convert<Option<Body>> for ChunkBody {
    fn read(body: Option<Body>, field: &'static str) -> Result<Self, WireError> {
        Ok(match required(body, field)? {
            Body::Header(header) => Self::Header(Convert::read(header, field)?),
            Body::Data(data) => {
                at_most(data.len(), MAX_CHUNK_BYTES, "chunk.data")?;
                Self::Data(data)
            }
        })
    }

    fn write(self) -> Option<Body> {
        Some(match self {
            Self::Header(header) => Body::Header(header.write()),
            Self::Data(data) => Body::Data(data),
        })
    }
}
