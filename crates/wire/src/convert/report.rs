//! Reports of nodes.

use cluster::{MeasuredCosts, SamplerReport, WorkReport};

use crate::error::WireError;
use crate::proto;

impl TryFrom<proto::ReportWorkRequest> for WorkReport {
    type Error = WireError;

    fn try_from(r: proto::ReportWorkRequest) -> Result<Self, WireError> {
        let costs = MeasuredCosts {
            sample_image_s: r.sample_image_s,
            direct_view_s: r.direct_view_s,
            reconstruct_view_s: r.reconstruct_view_s,
            load_set_s: r.load_set_s,
            encode_view_s: r.encode_view_s,
            transfer_bytes_per_s: r.transfer_bytes_per_s,
            image_bytes: r.image_bytes.map(|bytes| bytes as f64),
        };
        let report = Self {
            node_name: r.node_name,
            plan_epoch: r.plan_epoch,
            costs,
            busy_s: r.busy_s,
            views: r.view_count,
            dropped_views: r.dropped_view_count,
        };
        report.validate()?;
        Ok(report)
    }
}

impl From<WorkReport> for proto::ReportWorkRequest {
    fn from(r: WorkReport) -> Self {
        Self {
            node_name: r.node_name,
            plan_epoch: r.plan_epoch,
            sample_image_s: r.costs.sample_image_s,
            direct_view_s: r.costs.direct_view_s,
            reconstruct_view_s: r.costs.reconstruct_view_s,
            load_set_s: r.costs.load_set_s,
            encode_view_s: r.costs.encode_view_s,
            transfer_bytes_per_s: r.costs.transfer_bytes_per_s,
            image_bytes: r.costs.image_bytes.map(|bytes| bytes.round() as u64),
            busy_s: r.busy_s,
            view_count: r.views,
            dropped_view_count: r.dropped_views,
        }
    }
}

impl TryFrom<proto::ReportSamplerRequest> for SamplerReport {
    type Error = WireError;

    fn try_from(r: proto::ReportSamplerRequest) -> Result<Self, WireError> {
        let report =
            Self { plan_epoch: r.plan_epoch, compositor: r.compositor_name, sampler: r.sampler_name, reason: r.reason };
        report.validate()?;
        Ok(report)
    }
}

impl From<SamplerReport> for proto::ReportSamplerRequest {
    fn from(r: SamplerReport) -> Self {
        Self { plan_epoch: r.plan_epoch, compositor_name: r.compositor, sampler_name: r.sampler, reason: r.reason }
    }
}
