//! Plans for the whole cluster.

use std::num::NonZeroU32;

use cluster::limits::{MAX_CELLS, MAX_NODES, MAX_SAMPLE_CAMERAS, MAX_TILES};
use cluster::{Assignment, CompositorShare, SamplerShare, at_most, nonempty};

use super::policy::{policy_from, policy_to};
use crate::error::{WireError, required};
use crate::proto;

impl TryFrom<proto::Assignment> for Assignment {
    type Error = WireError;

    fn try_from(a: proto::Assignment) -> Result<Self, WireError> {
        at_most(a.samplers.len(), MAX_NODES, "samplers")?;
        at_most(a.compositors.len(), MAX_NODES, "compositors")?;
        let assignment = Self {
            plan_epoch: a.plan_epoch,
            policy: policy_from(a.policy)?,
            workload: required(a.workload, "assignment.workload")?.try_into()?,
            samplers: a.samplers.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            compositors: a.compositors.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            tile_count: a.tile_count.max(1),
            relay_fanout: NonZeroU32::new(a.relay_fanout_count),
        };
        assignment.validate()?;
        Ok(assignment)
    }
}

impl From<Assignment> for proto::Assignment {
    fn from(a: Assignment) -> Self {
        Self {
            plan_epoch: a.plan_epoch,
            policy: policy_to(a.policy),
            workload: Some(a.workload.into()),
            samplers: a.samplers.into_iter().map(Into::into).collect(),
            compositors: a.compositors.into_iter().map(Into::into).collect(),
            tile_count: a.tile_count,
            relay_fanout_count: a.relay_fanout.map_or(0, NonZeroU32::get),
        }
    }
}

impl TryFrom<proto::SamplerShare> for SamplerShare {
    type Error = WireError;

    fn try_from(s: proto::SamplerShare) -> Result<Self, WireError> {
        at_most(s.image_indices.len(), MAX_CELLS * MAX_SAMPLE_CAMERAS * MAX_TILES as usize, "image_indices")?;
        nonempty(&s.node_name, "node_name")?;
        nonempty(&s.node_address, "node_address")?;
        Ok(Self { node_name: s.node_name, address: s.node_address, image_indices: s.image_indices })
    }
}

impl From<SamplerShare> for proto::SamplerShare {
    fn from(s: SamplerShare) -> Self {
        Self { node_name: s.node_name, node_address: s.address, image_indices: s.image_indices }
    }
}

impl TryFrom<proto::CompositorShare> for CompositorShare {
    type Error = WireError;

    fn try_from(s: proto::CompositorShare) -> Result<Self, WireError> {
        nonempty(&s.node_name, "node_name")?;
        nonempty(&s.node_address, "node_address")?;
        Ok(Self { node_name: s.node_name, address: s.node_address, view_weight: s.dealt_view_count })
    }
}

impl From<CompositorShare> for proto::CompositorShare {
    fn from(s: CompositorShare) -> Self {
        Self { node_name: s.node_name, node_address: s.address, dealt_view_count: s.view_weight }
    }
}

impl TryFrom<proto::ApplyAssignmentRequest> for Assignment {
    type Error = WireError;

    fn try_from(r: proto::ApplyAssignmentRequest) -> Result<Self, WireError> {
        required(r.assignment, "assignment")?.try_into()
    }
}

impl From<Assignment> for proto::ApplyAssignmentRequest {
    fn from(assignment: Assignment) -> Self {
        Self { assignment: Some(assignment.into()) }
    }
}
