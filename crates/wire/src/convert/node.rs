//! Members: joining, being measured and being ready.

use cluster::limits::{MAX_BATCH, MAX_SCENES};
use cluster::{Costs, JoinCluster, MeasureCosts, NodeStatus, Ready, Welcome, at_most};
use depth_image::{PinholeCamera, ViewPlanes};

use super::geometry::{pinhole_from, pinhole_to};
use crate::error::{WireError, required};
use crate::proto;
use crate::protocol::{PROTOCOL_VERSION, check_version};

impl TryFrom<proto::JoinClusterRequest> for JoinCluster {
    type Error = WireError;

    fn try_from(r: proto::JoinClusterRequest) -> Result<Self, WireError> {
        check_version(r.protocol_version)?;
        let node = NodeStatus {
            node_name: r.node_name,
            address: r.node_address,
            device_name: r.device_name,
            is_software: r.is_software_device,
        };
        let join = Self { node, plan_epoch: r.plan_epoch };
        join.validate()?;
        Ok(join)
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

impl From<proto::NodeStatus> for NodeStatus {
    fn from(n: proto::NodeStatus) -> Self {
        Self {
            node_name: n.node_name,
            address: n.node_address,
            device_name: n.device_name,
            is_software: n.is_software_device,
        }
    }
}

impl From<NodeStatus> for proto::NodeStatus {
    fn from(n: NodeStatus) -> Self {
        Self {
            node_name: n.node_name,
            node_address: n.address,
            device_name: n.device_name,
            is_software_device: n.is_software,
        }
    }
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

impl TryFrom<proto::MeasureCostsRequest> for MeasureCosts {
    type Error = WireError;

    fn try_from(r: proto::MeasureCostsRequest) -> Result<Self, WireError> {
        let request = Self {
            workload: required(r.workload, "workload")?.try_into()?,
            typical_views: typical_views_from(r.typical_views)?,
            batch_count: r.batch_count,
            planes: ViewPlanes { inverse_depth: r.with_inverse_depth, provenance: r.with_provenance },
        };
        request.validate()?;
        Ok(request)
    }
}

fn typical_views_from(views: Vec<proto::PinholeCamera>) -> Result<Vec<PinholeCamera>, WireError> {
    at_most(views.len(), MAX_BATCH as usize, "typical_views")?;
    views.into_iter().map(|view| Ok(pinhole_from(Some(view), "typical_views")?)).collect()
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

impl TryFrom<proto::ApplyAssignmentResponse> for Ready {
    type Error = WireError;

    fn try_from(r: proto::ApplyAssignmentResponse) -> Result<Self, WireError> {
        let ready = Self { plan_epoch: r.plan_epoch, scene_load_s: r.scene_load_s };
        ready.validate()?;
        Ok(ready)
    }
}

impl From<Ready> for proto::ApplyAssignmentResponse {
    fn from(ready: Ready) -> Self {
        Self { plan_epoch: ready.plan_epoch, scene_load_s: ready.scene_load_s }
    }
}
