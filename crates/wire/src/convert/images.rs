//! Requests for sample images, and the chunks of these.

use cluster::{FetchImages, at_most};
use codec::{
    Chunk, ChunkBody, ImageHeader, MAX_CHUNK_BYTES, MAX_VISIBILITY_PLANES, PlaneEncoding, PlaneHeader, PlaneKind,
    SampleSetId,
};

use super::{Convert, required};
use crate::error::WireError;
use crate::proto::{self, chunk::Body};

/// One plane of each kind; visibility may have more.
const MAX_PLANES: usize = 5 + MAX_VISIBILITY_PLANES;

messages! {
    FetchSampleImagesRequest = FetchImages { plan_epoch, set_index, image_indices; cell: cell_index },
        then FetchImages::validate;
    ImageHeader = ImageHeader {
        planes; width: width_px, height: height_px,
        inverse_depth_range: least_inverse_depth_per_m | greatest_inverse_depth_per_m
    }, first |h| at_most(h.planes.len(), MAX_PLANES, "header.planes");
    PlaneHeader = PlaneHeader { kind as "planes.kind", encoding as "planes.encoding", raw_bytes, packed_bytes };
}

enums! {
    PlaneKind {
        InverseDepth, ColorRgb9e5, NormalOct16, SurfaceId, ReflectanceRoughness8, Visibility8, Passed1,
        CornerInverseDepth
    }
    PlaneEncoding { SlopeTaggedLz4, DifferenceTaggedLz4, ChangeTaggedLz4, BitsLz4 }
}

impl Convert<proto::FetchSampleImagesResponse> for Chunk {
    fn read(response: proto::FetchSampleImagesResponse, _: &'static str) -> Result<Self, WireError> {
        let c = required(response.chunk, "chunk")?;
        let body = match required(c.body, "chunk.body")? {
            Body::Header(header) => ChunkBody::Header(Convert::read(header, "chunk.header")?),
            Body::Data(data) => {
                at_most(data.len(), MAX_CHUNK_BYTES, "chunk.data")?;
                ChunkBody::Data(data)
            }
        };
        Ok(Self {
            sample_set_id: SampleSetId { plan_epoch: c.plan_epoch, index: c.set_index },
            image_index: c.image_index,
            sequence: c.sequence_number,
            chunk_count: c.chunk_count,
            crc32: c.body_crc32,
            body,
        })
    }

    fn write(self) -> proto::FetchSampleImagesResponse {
        let body = match self.body {
            ChunkBody::Header(header) => Body::Header(header.write()),
            ChunkBody::Data(data) => Body::Data(data),
        };
        let chunk = proto::Chunk {
            plan_epoch: self.sample_set_id.plan_epoch,
            set_index: self.sample_set_id.index,
            image_index: self.image_index,
            sequence_number: self.sequence,
            chunk_count: self.chunk_count,
            body_crc32: self.crc32,
            body: Some(body),
        };
        proto::FetchSampleImagesResponse { chunk: Some(chunk) }
    }
}
