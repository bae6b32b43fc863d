//! Requests for views, and frames in parts.

use cluster::{
    InvalidField, LiveRequest, RenderViews, RequestedView, check_seconds, check_view_count, check_view_size,
};
use codec::{FrameCodec, FrameHeader, FramePart, MAX_FRAME_BYTES, StageTimes};
use depth_image::ToneCurve;

use super::Convert;
use crate::error::WireError;

enums! { ToneCurve or None { None, KhronosNeutral } }

messages! {
    RenderViewsRequest = RenderViews {
        plan_epoch, workload_number, set_index, views, live;
        method: reconstruction_method, codec: frame_codec,
        planes: antialias_sample_count | exposure_ev | tone_curve | with_inverse_depth | with_provenance
    }, first |r| check_view_count(r.views.len(), r.live.is_some()), then RenderViews::validate;
    RequestedView = RequestedView { camera as "views.camera"; frame: frame_number };
    LiveRequest = LiveRequest { client_id, waits_for_set; acknowledged_frame: acknowledged_frame_number };
    RenderViewsResponse = FramePart { header, offset_bytes, data; frame: frame_number };
    FrameHeader = FrameHeader {
        camera as "header.camera", color_bytes, inverse_depth_bytes, provenance_bytes,
        stage_times as "header.stage_times", is_neighbour_cell; cell: cell_index,
        sample_set_id: plan_epoch | set_index, size_px: width_px | height_px, codec: frame_codec as "header.frame_codec",
        crc32: frame_crc32, antialias: antialias_sample_count, tone: exposure_ev | tone_curve
    }, then check_header;
    StageTimes = StageTimes {
        set_wait_s, credit_wait_s, queue_s, batch_s, reconstruct_s, encode_s, send_wait_s, compositor_s, set_age_s,
        batch_count
    }, then |times| {
        check_seconds!(times; set_wait_s, credit_wait_s, queue_s, batch_s, reconstruct_s, encode_s);
        check_seconds!(times; send_wait_s, compositor_s, set_age_s);
        Ok::<_, InvalidField>(())
    };
}

/// By its name in settings.
impl Convert<String> for FrameCodec {
    fn read(text: String, field: &'static str) -> Result<Self, WireError> {
        let short: String = text.chars().take(32).collect();
        Ok(text.parse().map_err(|_| InvalidField::out_of_range(field, short, "lz4, png, jpeg or jpeg:QUALITY"))?)
    }

    fn write(self) -> String {
        self.to_string()
    }
}

fn check_header(header: &FrameHeader) -> Result<(), InvalidField> {
    check_view_size(header.size_px, "header.size_px")?;
    if header.camera.size_px != header.size_px {
        return Err(InvalidField::out_of_range("header.camera.size_px", header.camera.size_px, "the frame's"));
    }
    match header.total_bytes() {
        0..=MAX_FRAME_BYTES => Ok(()),
        count => Err(InvalidField::TooMany { field: "header.total_bytes", count, limit: MAX_FRAME_BYTES }),
    }
}
