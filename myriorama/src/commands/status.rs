//! `myriorama status`: workloads and their demand, nodes with their roles and costs, and the reasons of the plans.

use std::io::Write as _;
use std::time::Duration;

use app_core::addresses::CoordinatorArgs;
use app_core::exit::Outcome;
use app_core::print_line;
use clap::Args;
use cluster::{ClusterStatus, NodeCondition, NodeStatus, SessionPlan, SharedLightCosts, Workload, WorkloadStatus};
use report::{Cell, Table};

/// Characters of a scene's hash that tell scenes apart.
const SHORT_HASH: usize = 8;

/// Prints the workloads of a cluster, the nodes of each with their roles and costs, and the reasons of the plans.
#[derive(Debug, Args)]
pub struct StatusArgs {
    #[command(flatten)]
    coordinator: CoordinatorArgs,
    /// Repeats every S seconds until ctrl-c
    #[arg(long, value_name = "S", num_args = 0..=1, default_missing_value = "1")]
    watch: Option<f64>,
}

/// Asks and prints.
///
/// # Errors
/// The coordinator does not answer.
pub async fn run(args: &StatusArgs) -> anyhow::Result<Outcome> {
    let client = args.coordinator.connect().await?;
    loop {
        let text = text(&client.status().await?);
        let Some(seconds) = args.watch else {
            print_line!("{text}");
            return Ok(Outcome::Done);
        };
        // The terminal is cleared, so that the table stays in place. Nobody may be reading any more.
        if writeln!(std::io::stdout(), "\x1b[2J\x1b[H{text}").is_err() {
            return Ok(Outcome::Done);
        }
        tokio::time::sleep(Duration::from_secs_f64(seconds.clamp(0.1, 3600.0))).await;
    }
}

/// The workloads, then the nodes of each.
fn text(status: &ClusterStatus) -> String {
    let mut parts = vec![workload_table(status).to_text()];
    parts.extend(status.workloads.iter().map(|workload| workload_text(workload, &status.nodes)));
    let mut idle = Vec::new();
    for node in &status.nodes {
        if !status.workloads.iter().any(|workload| condition(workload, node).is_some()) {
            idle.push(node.node_name.as_str());
        }
    }
    if !idle.is_empty() {
        parts.push(format!("Nodes without a workload: {}.", idle.join(", ")));
    }
    parts.join("\n\n")
}

fn workload_table(status: &ClusterStatus) -> Table {
    let headline = format!(
        "Plan {}: P = {} nodes, K = {} samplers, V = {} views a set of {} sessions",
        status.plan_epoch,
        status.nodes.len(),
        status.sampler_count(),
        status.views_per_set(),
        status.session_count()
    );
    Table::of_rows(
        headline,
        &status.workloads,
        &[
            ("workload", "", |workload| (workload.number as f64).into()),
            ("scene", "", |workload| plan_cell(workload, |plan| short_hash(&plan.assignment.workload).into())),
            ("light", "", |workload| plan_cell(workload, |plan| plan.assignment.workload.lighting.clone().into())),
            ("policy", "", |workload| plan_cell(workload, |plan| plan.assignment.policy.to_string().into())),
            ("K", "", |workload| plan_cell(workload, |plan| (plan.sampler_count() as f64).into())),
            ("sessions", "", |workload| f64::from(workload.session_count).into()),
            ("viewers", "", |workload| f64::from(workload.viewer_count).into()),
            ("V", "", |workload| (workload.views_per_set as f64).into()),
            ("used", "%", |workload| workload.utilisation.map_or(Cell::Missing, |used| (used * 100.0).into())),
            ("one more viewer", "%", |workload| (workload.one_more_viewer * 100.0).into()),
        ],
    )
}

fn plan_cell(workload: &WorkloadStatus, cell: fn(&SessionPlan) -> Cell) -> Cell {
    workload.plan.as_ref().map_or(Cell::Missing, cell)
}

fn short_hash(workload: &Workload) -> String {
    workload.scene.hash.as_str().chars().take(SHORT_HASH).collect()
}

/// A node and its part in a workload.
struct NodeRow<'a> {
    node: &'a NodeStatus,
    condition: &'a NodeCondition,
    roles: String,
}

/// The nodes of a workload, its plan's reason, and what it achieves.
fn workload_text(workload: &WorkloadStatus, nodes: &[NodeStatus]) -> String {
    let mut rows = Vec::new();
    for node in nodes {
        if let Some(condition) = condition(workload, node) {
            rows.push(NodeRow { node, condition, roles: roles(workload, &node.node_name) });
        }
    }
    let table = Table::of_rows(
        format!("Workload {}", workload.number),
        &rows,
        &[
            ("node", "", |row| row.node.node_name.clone().into()),
            ("roles", "", |row| row.roles.clone().into()),
            ("plan", "", |row| if row.condition.is_ready { "ready" } else { "not yet" }.into()),
            ("g", "ms", |row| (row.condition.costs.sample_image_s * 1e3).into()),
            ("g_v", "ms", |row| (row.condition.costs.direct_view_s * 1e3).into()),
            ("c", "ms", |row| (row.condition.costs.reconstruct_view_s * 1e3).into()),
            ("d", "ms", |row| (row.condition.costs.load_set_s * 1e3).into()),
            ("e", "ms", |row| (row.condition.costs.encode_view_s * 1e3).into()),
            ("busy", "%", |row| (row.condition.busy_ratio * 100.0).into()),
            ("views", "", |row| (row.condition.views as f64).into()),
            ("dropped", "", |row| (row.condition.dropped_views as f64).into()),
            ("device", "", |row| row.node.device_name.clone().into()),
        ],
    );
    let why = workload.plan.as_ref().map_or("No plan: no node can serve it now.", |plan| &plan.reason);
    let promise = workload.promise.as_ref().map_or_else(String::new, |promise| format!("\n{promise}"));
    format!("{}\n\n{why}{promise}\n{}", table.to_text(), achieved(workload))
}

/// Times that policies achieved, the load of the nodes, and where the time of a view with shared light goes.
fn achieved(workload: &WorkloadStatus) -> String {
    let achieved = workload.achieved.iter();
    let mut lines: Vec<String> =
        achieved.map(|a| format!("Achieved by {}: {:.3} ms a set.", a.policy, a.busy_s * 1e3)).collect();
    if let Some(utilisation) = workload.utilisation {
        let fallback = workload.plan.as_ref().and_then(|plan| plan.fallback);
        let quality = fallback.map_or("all that was asked for".to_owned(), |number| format!("fallback {number}"));
        lines.push(format!("Sessions take {:.0} % of its nodes' time and get {quality}.", utilisation * 100.0));
    }
    lines.extend(workload.shared_light.as_ref().map(light_text));
    lines.push(format!("One more viewer would take {:.1} % of all nodes' time.", workload.one_more_viewer * 100.0));
    lines.join("\n")
}

/// How much of a view's light samples know, and where its time goes.
fn light_text(light: &SharedLightCosts) -> String {
    let [surfaces_ms, look_up_ms, unknown_ms] =
        [light.surfaces_s, light.look_up_s, light.unknown_s].map(|seconds| seconds * 1e3);
    format!(
        "Samples know the light of {:.1} % of a view's points. Surfaces take {surfaces_ms:.1} ms, the look-up {look_up_ms:.1} ms, \
         and the other points {unknown_ms:.1} ms.",
        light.known_ratio * 100.0,
    )
}

fn condition<'a>(workload: &'a WorkloadStatus, node: &NodeStatus) -> Option<&'a NodeCondition> {
    workload.conditions.iter().find(|condition| condition.node_name == node.node_name)
}

fn roles(workload: &WorkloadStatus, name: &str) -> String {
    let Some(plan) = &workload.plan else { return "-".to_owned() };
    let images = plan.assignment.samplers.iter().find(|share| share.node_name == name);
    let samples = images.map(|share| format!("samples {:?}", share.image_indices));
    let composites = plan.assignment.composites(name).then(|| "composites".to_owned());
    let roles: Vec<String> = samples.into_iter().chain(composites).collect();
    if roles.is_empty() { "-".to_owned() } else { roles.join(", ") }
}
