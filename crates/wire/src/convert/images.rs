//! Requests for sample images, and the chunks of these.

use cluster::{FetchImages, at_most};
use codec::{
    Chunk, ChunkBody, ImageHeader, InverseDepthRange, MAX_CHUNK_BYTES, MAX_VISIBILITY_PLANES, PlaneEncoding,
    PlaneHeader, PlaneKind, SampleSetId,
};

use crate::error::{WireError, required};
use crate::proto;

/// One plane of each kind; visibility may have more.
const MAX_PLANES: usize = 5 + MAX_VISIBILITY_PLANES;

impl TryFrom<proto::FetchSampleImagesRequest> for FetchImages {
    type Error = WireError;

    fn try_from(r: proto::FetchSampleImagesRequest) -> Result<Self, WireError> {
        let request = Self {
            plan_epoch: r.plan_epoch,
            set_index: r.set_index,
            cell: r.cell_index,
            image_indices: r.image_indices,
        };
        request.validate()?;
        Ok(request)
    }
}

impl From<FetchImages> for proto::FetchSampleImagesRequest {
    fn from(r: FetchImages) -> Self {
        Self { plan_epoch: r.plan_epoch, set_index: r.set_index, cell_index: r.cell, image_indices: r.image_indices }
    }
}

impl TryFrom<proto::FetchSampleImagesResponse> for Chunk {
    type Error = WireError;

    fn try_from(r: proto::FetchSampleImagesResponse) -> Result<Self, WireError> {
        let c = required(r.chunk, "chunk")?;
        let body = match required(c.body, "chunk.body")? {
            proto::chunk::Body::Header(header) => ChunkBody::Header(header.try_into()?),
            proto::chunk::Body::Data(data) => {
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
}

impl From<Chunk> for proto::FetchSampleImagesResponse {
    fn from(c: Chunk) -> Self {
        let body = match c.body {
            ChunkBody::Header(header) => proto::chunk::Body::Header(header.into()),
            ChunkBody::Data(data) => proto::chunk::Body::Data(data),
        };
        let chunk = proto::Chunk {
            plan_epoch: c.sample_set_id.plan_epoch,
            set_index: c.sample_set_id.index,
            image_index: c.image_index,
            sequence_number: c.sequence,
            chunk_count: c.chunk_count,
            body_crc32: c.crc32,
            body: Some(body),
        };
        Self { chunk: Some(chunk) }
    }
}

impl TryFrom<proto::ImageHeader> for ImageHeader {
    type Error = WireError;

    fn try_from(h: proto::ImageHeader) -> Result<Self, WireError> {
        at_most(h.planes.len(), MAX_PLANES, "header.planes")?;
        let range = InverseDepthRange {
            least_per_m: h.least_inverse_depth_per_m,
            greatest_per_m: h.greatest_inverse_depth_per_m,
        };
        let planes = h.planes.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?;
        Ok(Self { width: h.width_px, height: h.height_px, inverse_depth_range: range, planes })
    }
}

impl From<ImageHeader> for proto::ImageHeader {
    fn from(h: ImageHeader) -> Self {
        Self {
            width_px: h.width,
            height_px: h.height,
            least_inverse_depth_per_m: h.inverse_depth_range.least_per_m,
            greatest_inverse_depth_per_m: h.inverse_depth_range.greatest_per_m,
            planes: h.planes.into_iter().map(Into::into).collect(),
        }
    }
}

impl TryFrom<proto::PlaneHeader> for PlaneHeader {
    type Error = WireError;

    fn try_from(p: proto::PlaneHeader) -> Result<Self, WireError> {
        let kind = match proto::PlaneKind::try_from(p.kind) {
            Ok(proto::PlaneKind::InverseDepth) => PlaneKind::InverseDepth,
            Ok(proto::PlaneKind::ColorRgb9e5) => PlaneKind::ColorRgb9e5,
            Ok(proto::PlaneKind::NormalOct16) => PlaneKind::NormalOct16,
            Ok(proto::PlaneKind::SurfaceId) => PlaneKind::SurfaceId,
            Ok(proto::PlaneKind::ReflectanceRoughness8) => PlaneKind::ReflectanceRoughness8,
            Ok(proto::PlaneKind::Visibility8) => PlaneKind::Visibility8,
            Ok(proto::PlaneKind::Passed1) => PlaneKind::Passed1,
            Ok(proto::PlaneKind::CornerInverseDepth) => PlaneKind::CornerInverseDepth,
            _ => {
                return Err(WireError::UnknownEnum { field: "planes.kind", value: p.kind });
            }
        };
        let encoding = match proto::PlaneEncoding::try_from(p.encoding) {
            Ok(proto::PlaneEncoding::SlopeTaggedLz4) => PlaneEncoding::SlopeTaggedLz4,
            Ok(proto::PlaneEncoding::DifferenceTaggedLz4) => PlaneEncoding::DifferenceTaggedLz4,
            Ok(proto::PlaneEncoding::ChangeTaggedLz4) => PlaneEncoding::ChangeTaggedLz4,
            Ok(proto::PlaneEncoding::BitsLz4) => PlaneEncoding::BitsLz4,
            _ => {
                return Err(WireError::UnknownEnum { field: "planes.encoding", value: p.encoding });
            }
        };
        Ok(Self { kind, encoding, raw_bytes: p.raw_bytes, packed_bytes: p.packed_bytes })
    }
}

impl From<PlaneHeader> for proto::PlaneHeader {
    fn from(p: PlaneHeader) -> Self {
        let kind = match p.kind {
            PlaneKind::InverseDepth => proto::PlaneKind::InverseDepth,
            PlaneKind::ColorRgb9e5 => proto::PlaneKind::ColorRgb9e5,
            PlaneKind::NormalOct16 => proto::PlaneKind::NormalOct16,
            PlaneKind::SurfaceId => proto::PlaneKind::SurfaceId,
            PlaneKind::ReflectanceRoughness8 => proto::PlaneKind::ReflectanceRoughness8,
            PlaneKind::Visibility8 => proto::PlaneKind::Visibility8,
            PlaneKind::Passed1 => proto::PlaneKind::Passed1,
            PlaneKind::CornerInverseDepth => proto::PlaneKind::CornerInverseDepth,
        };
        let encoding = match p.encoding {
            PlaneEncoding::SlopeTaggedLz4 => proto::PlaneEncoding::SlopeTaggedLz4,
            PlaneEncoding::DifferenceTaggedLz4 => proto::PlaneEncoding::DifferenceTaggedLz4,
            PlaneEncoding::ChangeTaggedLz4 => proto::PlaneEncoding::ChangeTaggedLz4,
            PlaneEncoding::BitsLz4 => proto::PlaneEncoding::BitsLz4,
        };
        Self { kind: kind.into(), encoding: encoding.into(), raw_bytes: p.raw_bytes, packed_bytes: p.packed_bytes }
    }
}
