//! Measured costs: at once for a session that waits for them, later where costs are known well enough to begin with.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{MeasureCosts, Measured, NodeStatus, SessionEvent, SessionStage};
use tonic::{Code, Status};
use wire::rpc::{Backoff, NodeClient};

use crate::cost_table::Known;
use crate::grpc_status::{of_node, within};
use crate::measuring_queue::Wanted;
use crate::sessions::EventSender;
use crate::shared::Shared;

/// How long one node may measure.
const MEASURED_WITHIN: Duration = Duration::from_secs(600);
/// What is not waited for is measured on a node whose host has had little to do for so long.
const IDLE_FOR: Duration = Duration::from_secs(5);
/// The interval at which idle nodes are sought.
const SEEK: Duration = Duration::from_secs(1);
/// A node has reported its work by then: it does so once a second.
const REPORTED_WITHIN: Duration = Duration::from_millis(1500);
/// Attempts to measure costs where nodes are lost meanwhile.
const ATTEMPTS: usize = 11;

/// The slowest device's costs, where those of all devices are known.
pub(crate) fn known(shared: &Shared, measurement: &MeasureCosts) -> Option<Measured> {
    let devices: BTreeSet<String> = shared.status().nodes.into_iter().map(|node| node.device_name).collect();
    let all = devices.iter().map(|device| shared.costs.find(device, measurement)).collect::<Option<Vec<Measured>>>()?;
    all.into_iter().reduce(slowest)
}

/// Measures what waits for idle nodes, one after the other, until it is aborted.
pub(crate) async fn measure_when_idle(shared: Arc<Shared>) {
    let mut seek = tokio::time::interval(SEEK);
    seek.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        seek.tick().await;
        let Some((wanted, node)) = next(&shared) else { continue };
        match measured_on(&shared, &wanted.measurement, &node).await {
            Ok(Known { is_settled: true, .. }) => (),
            Ok(_) => shared.costs.wanted.lock().add_again(wanted),
            Err(status) => tracing::debug!(reason = status.message(), "not measured"),
        }
    }
}

/// The next measurement for which there is an idle node.
fn next(shared: &Shared) -> Option<(Wanted, NodeStatus)> {
    let mut queue = shared.costs.wanted.lock();
    if !queue.is_quiet_for(IDLE_FOR) {
        return None;
    }
    let devices: BTreeSet<&str> = queue.devices().collect();
    let mut nodes = shared.status().nodes;
    nodes.retain(|node| {
        let idle_for = shared.with_scheduler(|scheduler| scheduler.idle_for(&node.node_name));
        devices.contains(node.device_name.as_str()) && idle_for >= IDLE_FOR
    });
    let wanted = queue.take(|device| nodes.iter().any(|node| node.device_name == device))?;
    let node = nodes.into_iter().find(|node| node.device_name == wanted.device)?;
    Some((wanted, node))
}

/// Known costs, else measured ones. A node may be lost while it measures: others of its kind are asked once it has left.
pub(crate) async fn known_or_measured(
    shared: &Shared,
    measurement: &MeasureCosts,
    events: &EventSender,
) -> Result<Measured, Status> {
    if let Some(known) = known(shared, measurement) {
        return Ok(known);
    }
    let mut backoff = Backoff::reconnect();
    for _ in 1..ATTEMPTS {
        match measured(shared, measurement, events).await {
            Err(status) if [Code::Unavailable, Code::Unknown].contains(&status.code()) => {
                let detail = format!("measuring again: {}", status.message());
                send_progress(events, SessionStage::Measuring, detail);
                tokio::time::sleep(backoff.next_delay()).await;
            }
            done => return done,
        }
    }
    measured(shared, measurement, events).await
}

pub(crate) fn send_progress(events: &EventSender, stage: SessionStage, detail: String) {
    // The guard of a client's stream notices that the client has left. One that does not read misses a line.
    let _ = events.try_send(Ok(SessionEvent::Progress { stage, detail }));
}

/// The slowest device's costs: one node of each device measures, one after the other.
async fn measured(shared: &Shared, measurement: &MeasureCosts, events: &EventSender) -> Result<Measured, Status> {
    let nodes = shared.status().nodes;
    let devices: BTreeMap<String, NodeStatus> =
        nodes.into_iter().rev().map(|node| (node.device_name.clone(), node)).collect();
    let mut all = Vec::new();
    for (device, node) in devices {
        if let Some(known) = shared.costs.find(&device, measurement) {
            all.push(known);
            continue;
        }
        let detail = format!("{} measures its costs on {device}", node.node_name);
        send_progress(events, SessionStage::Measuring, detail);
        let known = measured_on(shared, measurement, &node).await?;
        if !known.is_settled {
            shared.costs.wanted.lock().add(&device, measurement);
        }
        all.push(known.measured);
    }
    all.into_iter().reduce(slowest).ok_or_else(|| Status::failed_precondition("no node has joined the cluster"))
}

/// Has a node measure, and keeps the costs. They are settled where the node did no other work meanwhile.
async fn measured_on(shared: &Shared, measurement: &MeasureCosts, node: &NodeStatus) -> Result<Known, Status> {
    let start = Instant::now();
    let call =
        async { NodeClient::new(shared.connections.to(&node.address).await?).measure_costs(measurement.clone()).await };
    let fresh = within(MEASURED_WITHIN, "measuring", call).await;
    let measured = fresh.map_err(|status| of_node(&node.node_name, &status))?;
    let MeasureCosts { method, in_background, .. } = measurement;
    tracing::debug!(
        node = node.node_name,
        method,
        in_background,
        seconds = start.elapsed().as_secs_f64(),
        "costs measured"
    );
    if measurement.in_background {
        tokio::time::sleep(REPORTED_WITHIN).await;
    }
    let idle_for = shared.with_scheduler(|scheduler| scheduler.idle_for(&node.node_name));
    let known = Known { measured, is_settled: was_idle(idle_for, start.elapsed()) };
    shared.costs.insert(&node.device_name, measurement, known.clone());
    Ok(known)
}

/// Whether a node was idle for `elapsed`, and in the report before.
fn was_idle(idle_for: Duration, elapsed: Duration) -> bool {
    idle_for > elapsed + REPORTED_WITHIN
}

/// Which planes a method needs is the same on every node, and the exposure nearly. All nodes find surfaces as the first one would.
/// The parts of a view are those of the device whose views take longest.
fn slowest(one: Measured, other: Measured) -> Measured {
    let is_slower = other.costs.reconstruct_view_s > one.costs.reconstruct_view_s;
    let shared_light = if is_slower { other.shared_light } else { one.shared_light };
    Measured { costs: one.costs.max(other.costs), shared_light, ..one }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_not_settled_where_the_node_worked_before_or_meanwhile() {
        let elapsed = Duration::from_secs(4);
        let idle_s = [0.5, 3.9, 5.0, 5.6, 1e6];
        let settled = idle_s.map(|idle_s| was_idle(Duration::from_secs_f64(idle_s), elapsed));
        assert_eq!(settled, [false, false, false, true, true]);
        assert!(was_idle(Duration::MAX, elapsed), "it has never worked");
    }
}
