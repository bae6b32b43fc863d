//! A cluster's state as a table: nodes, roles, costs, and why.

use study::{Cell, Table};
use wire::{ClusterStatus, NodeStatus};

use crate::text_table;

const COLUMNS: [(&str, &str); 9] = [
    ("node", ""),
    ("roles", ""),
    ("plan", ""),
    ("g", "ms"),
    ("g_v", "ms"),
    ("c", "ms"),
    ("d", "ms"),
    ("e", "ms"),
    ("device", ""),
];

/// As `myriorama status` prints it.
///
/// # Errors
/// A row that does not fit, which is a fault here.
pub fn text(status: &ClusterStatus) -> anyhow::Result<String> {
    let mut table = Table::new(headline(status), &COLUMNS);
    for node in &status.nodes {
        table.push(row(status, node))?;
    }
    let why = status
        .plan
        .as_ref()
        .map_or_else(|| "No plan: nobody has asked for views.".to_owned(), |plan| plan.reason.clone());
    Ok(format!("{}\n\n{why}", text_table::text(&table)))
}

fn headline(status: &ClusterStatus) -> String {
    let ClusterStatus { plan_epoch, nodes, session_count, views_per_set, .. } = status;
    let p = nodes.len();
    let k = status.plan.as_ref().map_or(0, |plan| plan.assignment.samplers.len());
    format!(
        "Plan {plan_epoch}: P = {p} nodes, K = {k} samplers, V = {views_per_set} views a set of {session_count} sessions"
    )
}

fn row(status: &ClusterStatus, node: &NodeStatus) -> Vec<Cell> {
    let condition = status.conditions.iter().find(|condition| condition.node_name == node.node_name);
    let plan = condition.map_or("-", |condition| if condition.is_ready { "ready" } else { "not yet" });
    let costs = condition.map(|condition| {
        let costs = condition.costs;
        let seconds = [
            costs.sample_image_s,
            costs.direct_view_s,
            costs.reconstruct_view_s,
            costs.load_set_s,
            costs.encode_view_s,
        ];
        seconds.map(|s| Cell::from(s * 1e3))
    });
    let head = [node.node_name.clone().into(), roles(status, &node.node_name).into(), plan.into()];
    let costs = costs.map_or_else(|| vec![Cell::Missing; 5], Vec::from);
    head.into_iter().chain(costs).chain([node.device_name.clone().into()]).collect()
}

fn roles(status: &ClusterStatus, name: &str) -> String {
    let Some(plan) = &status.plan else { return "-".to_owned() };
    let images = plan.assignment.samplers.iter().find(|share| share.node_name == name);
    let samples = images.map(|share| format!("samples {:?}", share.image_indices));
    let composites = plan.assignment.composites(name).then(|| "composites".to_owned());
    let roles: Vec<String> = samples.into_iter().chain(composites).collect();
    if roles.is_empty() { "-".to_owned() } else { roles.join(", ") }
}
