//! Joining, being measured and being told what to do.

use depth_image::{PinholeCamera, ViewPlanes};

use crate::error::{WireError, at_most, required};
use crate::geometry::{pinhole_from, pinhole_to};
use crate::limits::{MAX_BATCH, MAX_NODES, MAX_SCENES, nonempty, seconds, text};
use crate::protocol::{PROTOCOL_VERSION, same_version};
use crate::{Assignment, Costs, OfferStatus, Policy, SceneRef, SessionPlan, Workload, proto};

/// More policies than there will be.
const MAX_POLICIES: usize = 16;

/// A node that wants to be a member.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JoinCluster {
    /// The node, its address and its device.
    pub node: NodeStatus,
    /// The highest plan it has seen.
    pub plan_epoch: u64,
}

/// A member.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeStatus {
    /// Unique in the cluster; of two with one name the later counts.
    pub node_name: String,
    /// Where other processes reach it, as `http://host:port`.
    pub address: String,
    /// As every reported time names it.
    pub device_name: String,
    /// Whether the device is a CPU.
    pub is_software: bool,
}

/// A coordinator goes on from the highest epoch that a member has had, which must leave room.
const MOST_PLANS: u64 = 1 << 48;

impl TryFrom<proto::JoinClusterRequest> for JoinCluster {
    type Error = WireError;

    fn try_from(r: proto::JoinClusterRequest) -> Result<Self, WireError> {
        same_version(r.protocol_version)?;
        let node = NodeStatus {
            node_name: nonempty(r.node_name, "node_name")?,
            address: nonempty(r.node_address, "node_address")?,
            device_name: text(r.device_name, "device_name")?,
            is_software: r.is_software_device,
        };
        if r.plan_epoch > MOST_PLANS {
            return Err(WireError::out_of_range("plan_epoch", r.plan_epoch, "at most 2^48"));
        }
        Ok(Self { node, plan_epoch: r.plan_epoch })
    }
}

impl From<JoinCluster> for proto::JoinClusterRequest {
    fn from(j: JoinCluster) -> Self {
        Self {
            node_name: j.node.node_name,
            node_address: j.node.address,
            device_name: j.node.device_name,
            is_software_device: j.node.is_software,
            plan_epoch: j.plan_epoch,
            protocol_version: PROTOCOL_VERSION,
        }
    }
}

/// What a member is told on joining: scenes to load ahead.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Welcome {
    /// On offer.
    pub scenes: Vec<SceneRef>,
}

impl TryFrom<proto::JoinClusterResponse> for Welcome {
    type Error = WireError;

    fn try_from(r: proto::JoinClusterResponse) -> Result<Self, WireError> {
        at_most(r.scenes.len(), MAX_SCENES, "scenes")?;
        Ok(Self { scenes: r.scenes.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()? })
    }
}

impl From<Welcome> for proto::JoinClusterResponse {
    fn from(w: Welcome) -> Self {
        Self { scenes: w.scenes.into_iter().map(Into::into).collect() }
    }
}

/// The cluster as the coordinator sees it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ClusterStatus {
    /// The highest plan so far.
    pub plan_epoch: u64,
    /// Members by name.
    pub nodes: Vec<NodeStatus>,
    /// The scene, and what it is shown with.
    pub offer: Option<OfferStatus>,
    /// In force; `None` while nothing is asked for, or nobody is there to do it.
    pub plan: Option<Box<SessionPlan>>,
    /// Sessions that share the plan, or wait for one.
    pub session_count: u32,
    /// V: views that all of them ask of each sample set.
    pub views_per_set: u64,
    /// Of every member, while anything is asked for.
    pub conditions: Vec<NodeCondition>,
    /// Of each policy that has been in force for what is asked for.
    pub achieved: Vec<AchievedTime>,
    /// What share of the plan's nodes' time all sessions' pictures a second take; 0 where none states a rate.
    pub utilisation: f64,
}

/// What a policy took, as nodes timed themselves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AchievedTime {
    /// Which.
    pub policy: Policy,
    /// Of the busiest node, for all views of a set.
    pub busy_s: f64,
}

impl TryFrom<proto::AchievedTime> for AchievedTime {
    type Error = WireError;

    fn try_from(a: proto::AchievedTime) -> Result<Self, WireError> {
        Ok(Self { policy: Policy::from_wire(a.policy)?, busy_s: seconds(a.busy_s, "busy_s")? })
    }
}

impl From<AchievedTime> for proto::AchievedTime {
    fn from(a: AchievedTime) -> Self {
        Self { policy: a.policy.to_wire(), busy_s: a.busy_s }
    }
}

/// How a member stands.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeCondition {
    /// Who.
    pub node_name: String,
    /// For the plan in force.
    pub is_ready: bool,
    /// As estimated now, from the node's own timings.
    pub costs: Costs,
    /// Views made since it joined.
    pub views: u64,
    /// Views not made, or not sent, since it joined.
    pub dropped_views: u64,
    /// Of its last report, what share of the time it worked; two operations at a time count twice.
    pub busy_ratio: f64,
}

impl TryFrom<proto::NodeCondition> for NodeCondition {
    type Error = WireError;

    fn try_from(c: proto::NodeCondition) -> Result<Self, WireError> {
        Ok(Self {
            node_name: nonempty(c.node_name, "node_name")?,
            is_ready: c.is_ready,
            costs: required(c.costs, "costs")?.try_into()?,
            views: c.view_count,
            dropped_views: c.dropped_view_count,
            busy_ratio: seconds(c.busy_ratio, "busy_ratio")?,
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
        at_most(r.nodes.len(), MAX_NODES, "nodes")?;
        at_most(r.conditions.len(), MAX_NODES, "conditions")?;
        at_most(r.achieved_times.len(), MAX_POLICIES, "achieved_times")?;
        let node = |n: proto::NodeStatus| NodeStatus {
            node_name: n.node_name,
            address: n.node_address,
            device_name: n.device_name,
            is_software: n.is_software_device,
        };
        Ok(Self {
            plan_epoch: r.plan_epoch,
            nodes: r.nodes.into_iter().map(node).collect(),
            offer: r.offer.map(TryInto::try_into).transpose()?,
            plan: r.plan.map(|plan| plan.try_into().map(Box::new)).transpose()?,
            session_count: r.session_count,
            views_per_set: r.views_per_set_count,
            conditions: r.conditions.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            achieved: r.achieved_times.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            utilisation: seconds(r.utilisation_ratio, "utilisation_ratio")?,
        })
    }
}

impl From<ClusterStatus> for proto::GetStatusResponse {
    fn from(status: ClusterStatus) -> Self {
        let node = |n: NodeStatus| proto::NodeStatus {
            node_name: n.node_name,
            node_address: n.address,
            device_name: n.device_name,
            is_software_device: n.is_software,
        };
        Self {
            plan_epoch: status.plan_epoch,
            nodes: status.nodes.into_iter().map(node).collect(),
            offer: status.offer.map(Into::into),
            plan: status.plan.map(|plan| (*plan).into()),
            session_count: status.session_count,
            views_per_set_count: status.views_per_set,
            conditions: status.conditions.into_iter().map(Into::into).collect(),
            achieved_times: status.achieved.into_iter().map(Into::into).collect(),
            utilisation_ratio: status.utilisation,
        }
    }
}

/// Asks a node what operations cost it.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasureCosts {
    /// What is measured; of the timeline, set 0.
    pub workload: Workload,
    /// Views that are reconstructed and drawn, in turn: of one size, at least one. What a view costs depends on where it
    /// stands.
    pub typical_views: Vec<PinholeCamera>,
    /// Most views of one call: fewer are drawn directly where they take long.
    pub batch_count: u32,
    /// Planes of the views.
    pub planes: ViewPlanes,
}

impl TryFrom<proto::MeasureCostsRequest> for MeasureCosts {
    type Error = WireError;

    fn try_from(r: proto::MeasureCostsRequest) -> Result<Self, WireError> {
        if !(1..=MAX_BATCH).contains(&r.batch_count) {
            return Err(WireError::out_of_range("batch_count", r.batch_count, "from 1 to 64"));
        }
        let workload: Workload = required(r.workload, "workload")?.try_into()?;
        if workload.sample_cameras.is_empty() {
            return Err(WireError::Missing { field: "sample_cameras" });
        }
        Ok(Self {
            workload,
            typical_views: typical_views_from(r.typical_views)?,
            batch_count: r.batch_count,
            planes: ViewPlanes { inverse_depth: r.with_inverse_depth, provenance: r.with_provenance },
        })
    }
}

fn typical_views_from(views: Vec<proto::PinholeCamera>) -> Result<Vec<PinholeCamera>, WireError> {
    at_most(views.len(), MAX_BATCH as usize, "typical_views")?;
    let views: Vec<_> =
        views.into_iter().map(|view| pinhole_from(Some(view), "typical_views")).collect::<Result<_, _>>()?;
    let first = views.first().ok_or(WireError::Missing { field: "typical_views" })?;
    match views.iter().find(|view| view.size_px != first.size_px) {
        Some(other) => Err(WireError::out_of_range("typical_views", other.size_px, "all of one size")),
        None => Ok(views),
    }
}

impl MeasureCosts {
    /// So many of its views, in turn.
    #[must_use]
    pub fn views(&self, count: u32) -> Vec<PinholeCamera> {
        self.typical_views.iter().copied().cycle().take(count as usize).collect()
    }
}

impl From<MeasureCosts> for proto::MeasureCostsRequest {
    fn from(m: MeasureCosts) -> Self {
        Self {
            workload: Some(m.workload.into()),
            typical_views: m.typical_views.iter().map(pinhole_to).collect(),
            batch_count: m.batch_count,
            with_inverse_depth: m.planes.inverse_depth,
            with_provenance: m.planes.provenance,
        }
    }
}

impl TryFrom<proto::MeasureCostsResponse> for Costs {
    type Error = WireError;

    fn try_from(r: proto::MeasureCostsResponse) -> Result<Self, WireError> {
        required(r.costs, "costs")?.try_into()
    }
}

impl From<Costs> for proto::MeasureCostsResponse {
    fn from(costs: Costs) -> Self {
        Self { costs: Some(costs.into()) }
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

/// A node is ready for a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ready {
    /// For which.
    pub plan_epoch: u64,
    /// What loading the scene took; 0 where it was there.
    pub scene_load_s: f64,
}

impl TryFrom<proto::ApplyAssignmentResponse> for Ready {
    type Error = WireError;

    fn try_from(r: proto::ApplyAssignmentResponse) -> Result<Self, WireError> {
        Ok(Self { plan_epoch: r.plan_epoch, scene_load_s: seconds(r.scene_load_s, "scene_load_s")? })
    }
}

impl From<Ready> for proto::ApplyAssignmentResponse {
    fn from(ready: Ready) -> Self {
        Self { plan_epoch: ready.plan_epoch, scene_load_s: ready.scene_load_s }
    }
}

#[cfg(test)]
mod tests {
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::message_tests::workload;

    fn view(size_px: u32) -> PinholeCamera {
        PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(size_px))
    }

    fn measure(typical_views: Vec<PinholeCamera>) -> MeasureCosts {
        MeasureCosts { workload: workload(), typical_views, batch_count: 5, planes: ViewPlanes::default() }
    }

    fn sent(measure: MeasureCosts) -> Result<MeasureCosts, WireError> {
        proto::MeasureCostsRequest::from(measure).try_into()
    }

    #[test]
    fn plans_have_room_to_go_on() {
        let node = NodeStatus {
            node_name: "n".to_owned(),
            address: "http://127.0.0.1:1".to_owned(),
            device_name: "d".to_owned(),
            is_software: true,
        };
        let join = |plan_epoch| proto::JoinClusterRequest::from(JoinCluster { node: node.clone(), plan_epoch });
        assert!(JoinCluster::try_from(join(MOST_PLANS)).is_ok());
        let refused = JoinCluster::try_from(join(u64::MAX)).unwrap_err().to_string();
        assert!(refused.contains("plan_epoch is 18446744073709551615"), "{refused}");
    }

    #[test]
    fn views_to_be_timed_are_of_one_size_and_some() {
        let three = measure(vec![view(8); 3]);
        assert_eq!(sent(three.clone()), Ok(three.clone()));
        let other = PinholeCamera { eye_in_world: Vec3::X, ..view(8) };
        let two = measure(vec![view(8), other]);
        assert_eq!(two.views(3), [view(8), other, view(8)]);
        for views in [vec![], vec![view(8), view(9)], vec![view(8); MAX_BATCH as usize + 1]] {
            assert!(sent(measure(views)).unwrap_err().to_string().contains("typical_views"));
        }
    }
}
