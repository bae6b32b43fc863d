//! What nodes say of their own work, and of each other.

use crate::error::WireError;
use crate::limits::{nonempty, reason, seconds};
use crate::proto;

/// A node's own timings of one report, the mean of each operation; what it did not do is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeasuredCosts {
    /// g_s: one finished sample image.
    pub sample_image_s: Option<f64>,
    /// g_v: one view drawn directly.
    pub direct_view_s: Option<f64>,
    /// c: one view reconstructed.
    pub reconstruct_view_s: Option<f64>,
    /// d: one sample set decoded and uploaded.
    pub load_set_s: Option<f64>,
    /// e: one view encoded.
    pub encode_view_s: Option<f64>,
    /// Depth images to this node.
    pub transfer_bytes_per_s: Option<f64>,
    /// B: one encoded sample image.
    pub image_bytes: Option<f64>,
}

/// What a member has done since its last report.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkReport {
    /// Who.
    pub node_name: String,
    /// Under which plan.
    pub plan_epoch: u64,
    /// What operations took.
    pub costs: MeasuredCosts,
    /// All of them together.
    pub busy_s: f64,
    /// Views made.
    pub views: u64,
    /// Views not made, or not sent.
    pub dropped_views: u64,
}

impl TryFrom<proto::ReportWorkRequest> for WorkReport {
    type Error = WireError;

    fn try_from(r: proto::ReportWorkRequest) -> Result<Self, WireError> {
        let some = |value: Option<f64>, field| value.map(|value| seconds(value, field)).transpose();
        let costs = MeasuredCosts {
            sample_image_s: some(r.sample_image_s, "sample_image_s")?,
            direct_view_s: some(r.direct_view_s, "direct_view_s")?,
            reconstruct_view_s: some(r.reconstruct_view_s, "reconstruct_view_s")?,
            load_set_s: some(r.load_set_s, "load_set_s")?,
            encode_view_s: some(r.encode_view_s, "encode_view_s")?,
            transfer_bytes_per_s: some(r.transfer_bytes_per_s, "transfer_bytes_per_s")?,
            image_bytes: r.image_bytes.map(|bytes| bytes as f64),
        };
        Ok(Self {
            node_name: nonempty(r.node_name, "node_name")?,
            plan_epoch: r.plan_epoch,
            costs,
            busy_s: seconds(r.busy_s, "busy_s")?,
            views: r.view_count,
            dropped_views: r.dropped_view_count,
        })
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

/// A compositor cannot get images of a sampler, though it asked again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SamplerReport {
    /// In which both have their roles.
    pub plan_epoch: u64,
    /// Who says so.
    pub compositor: String,
    /// Of whom.
    pub sampler: String,
    /// What went wrong.
    pub reason: String,
}

impl TryFrom<proto::ReportSamplerRequest> for SamplerReport {
    type Error = WireError;

    fn try_from(r: proto::ReportSamplerRequest) -> Result<Self, WireError> {
        Ok(Self {
            plan_epoch: r.plan_epoch,
            compositor: nonempty(r.compositor_name, "compositor_name")?,
            sampler: nonempty(r.sampler_name, "sampler_name")?,
            reason: reason(r.reason, "reason")?,
        })
    }
}

impl From<SamplerReport> for proto::ReportSamplerRequest {
    fn from(r: SamplerReport) -> Self {
        Self { plan_epoch: r.plan_epoch, compositor_name: r.compositor, sampler_name: r.sampler, reason: r.reason }
    }
}
