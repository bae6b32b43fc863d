//! Requests for views.

use cluster::{LiveRequest, RenderViews, RequestedView, check_view_count};
use depth_image::ViewPlanes;

use super::frames::frame_codec;
use super::geometry::{pinhole_from, pinhole_to};
use crate::error::WireError;
use crate::proto;

impl TryFrom<proto::RenderViewsRequest> for RenderViews {
    type Error = WireError;

    fn try_from(r: proto::RenderViewsRequest) -> Result<Self, WireError> {
        check_view_count(r.views.len(), r.live.is_some())?;
        let request = Self {
            plan_epoch: r.plan_epoch,
            set_index: r.set_index,
            method: r.reconstruction_method,
            codec: frame_codec(&r.frame_codec, "frame_codec")?,
            planes: ViewPlanes { inverse_depth: r.with_inverse_depth, provenance: r.with_provenance },
            views: r.views.into_iter().map(TryInto::try_into).collect::<Result<_, WireError>>()?,
            live: r.live.map(Into::into),
        };
        request.validate()?;
        Ok(request)
    }
}

impl From<RenderViews> for proto::RenderViewsRequest {
    fn from(r: RenderViews) -> Self {
        Self {
            plan_epoch: r.plan_epoch,
            set_index: r.set_index,
            reconstruction_method: r.method,
            frame_codec: r.codec.to_string(),
            with_inverse_depth: r.planes.inverse_depth,
            with_provenance: r.planes.provenance,
            views: r.views.into_iter().map(Into::into).collect(),
            live: r.live.map(Into::into),
        }
    }
}

impl TryFrom<proto::RequestedView> for RequestedView {
    type Error = WireError;

    fn try_from(v: proto::RequestedView) -> Result<Self, WireError> {
        Ok(Self { frame: v.frame_number, camera: pinhole_from(v.camera, "views.camera")? })
    }
}

impl From<RequestedView> for proto::RequestedView {
    fn from(v: RequestedView) -> Self {
        Self { frame_number: v.frame, camera: Some(pinhole_to(&v.camera)) }
    }
}

impl From<proto::LiveRequest> for LiveRequest {
    fn from(r: proto::LiveRequest) -> Self {
        Self { acknowledged_frame: r.acknowledged_frame_number, client_id: r.client_id }
    }
}

impl From<LiveRequest> for proto::LiveRequest {
    fn from(r: LiveRequest) -> Self {
        Self { acknowledged_frame_number: r.acknowledged_frame, client_id: r.client_id }
    }
}
