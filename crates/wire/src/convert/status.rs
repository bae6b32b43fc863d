//! The cluster as the coordinator sees it.

use cluster::{AchievedTime, ClusterStatus, NodeCondition};

use super::policy::{policy_from, policy_to};
use crate::error::{WireError, required};
use crate::proto;

impl TryFrom<proto::AchievedTime> for AchievedTime {
    type Error = WireError;

    fn try_from(a: proto::AchievedTime) -> Result<Self, WireError> {
        Ok(Self { policy: policy_from(a.policy)?, busy_s: a.busy_s })
    }
}

impl From<AchievedTime> for proto::AchievedTime {
    fn from(a: AchievedTime) -> Self {
        Self { policy: policy_to(a.policy), busy_s: a.busy_s }
    }
}

impl TryFrom<proto::NodeCondition> for NodeCondition {
    type Error = WireError;

    fn try_from(c: proto::NodeCondition) -> Result<Self, WireError> {
        Ok(Self {
            node_name: c.node_name,
            is_ready: c.is_ready,
            costs: required(c.costs, "costs")?.try_into()?,
            views: c.view_count,
            dropped_views: c.dropped_view_count,
            busy_ratio: c.busy_ratio,
        })
    }
}

impl From<NodeCondition> for proto::NodeCondition {
    fn from(c: NodeCondition) -> Self {
        Self {
            node_name: c.node_name,
            is_ready: c.is_ready,
            costs: Some(c.costs.into()),
            view_count: c.views,
            dropped_view_count: c.dropped_views,
            busy_ratio: c.busy_ratio,
        }
    }
}

impl TryFrom<proto::GetStatusResponse> for ClusterStatus {
    type Error = WireError;

    fn try_from(r: proto::GetStatusResponse) -> Result<Self, WireError> {
        let status = Self {
            plan_epoch: r.plan_epoch,
            nodes: r.nodes.into_iter().map(Into::into).collect(),
            offer: r.offer.map(TryInto::try_into).transpose()?,
            plan: r.plan.map(|plan| plan.try_into().map(Box::new)).transpose()?,
            session_count: r.session_count,
            views_per_set: r.views_per_set_count,
            conditions: r.conditions.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            achieved: r.achieved_times.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            utilisation: (r.utilisation_ratio != 0.0).then_some(r.utilisation_ratio),
        };
        status.validate()?;
        Ok(status)
    }
}

impl From<ClusterStatus> for proto::GetStatusResponse {
    fn from(status: ClusterStatus) -> Self {
        Self {
            plan_epoch: status.plan_epoch,
            nodes: status.nodes.into_iter().map(Into::into).collect(),
            offer: status.offer.map(Into::into),
            plan: status.plan.map(|plan| (*plan).into()),
            session_count: status.session_count,
            views_per_set_count: status.views_per_set,
            conditions: status.conditions.into_iter().map(Into::into).collect(),
            achieved_times: status.achieved.into_iter().map(Into::into).collect(),
            utilisation_ratio: status.utilisation.unwrap_or_default(),
        }
    }
}
