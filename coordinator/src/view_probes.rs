//! Requests of the planning for a budget to nodes.

use std::sync::Arc;
use std::time::Duration;

use cluster::SamplePlanes;
use planner::Probed;
use tonic::{Code, Status};
use wire::rpc::NodeClient;

use crate::grpc_status::{of_node, within};
use crate::schedule::{Event, ViewProbe};
use crate::shared::Shared;

/// How long a node may measure, waits for other work included.
const PROBED_WITHIN: Duration = Duration::from_secs(600);

/// Has a node measure views.
pub(crate) async fn probe_views(shared: Arc<Shared>, probe: ViewProbe) {
    let ViewProbe { workload_number, id, node_name, .. } = probe.clone();
    let asking = tokio::spawn({
        let shared = shared.clone();
        async move { probed(&shared, probe).await }
    });
    // Whatever becomes of the task, the schedule hears of it.
    let answer = asking.await.unwrap_or_else(|error| Err(Status::unavailable(error.to_string())));
    shared.step(match answer {
        Ok((probed, planes)) => Event::ViewsProbed { workload_number, probed: Box::new(probed), planes },
        Err(status) => {
            tracing::info!(node = node_name, reason = status.message(), "views are not measured");
            // The node answered, and would answer the same again.
            let is_lost = ![Code::InvalidArgument, Code::Unimplemented, Code::OutOfRange].contains(&status.code());
            Event::ProbeFailed { workload_number, id, is_lost }
        }
    });
}

async fn probed(shared: &Shared, probe: ViewProbe) -> Result<(Probed, SamplePlanes), Status> {
    let ViewProbe { id, address, request, .. } = probe;
    let node = NodeClient::new(shared.connections.to(&address).await?);
    let answer = within(PROBED_WITHIN, "measuring views", node.measure_costs(request)).await;
    let measured = answer.map_err(|status| of_node(&address, &status))?;
    let planes = measured.planes;
    let probed = measured.probed(id);
    probed.validate().map_err(|error| Status::out_of_range(format!("{address}: {error}")))?;
    Ok((probed, planes))
}
