//! `myriorama status`: workloads and their demand, nodes with their roles and costs, and the reasons of the plans.

use std::io::Write as _;
use std::time::Duration;

use app_core::addresses::CoordinatorArgs;
use app_core::exit::Outcome;
use app_core::print_line;
use clap::Args;
use cluster::{ClusterStatus, Costs, NodeCondition, NodeStatus, SharedLightCosts, WorkloadStatus};
use report::{Cell, Table};

const WORKLOAD_COLUMNS: [(&str, &str); 10] = [
    ("workload", ""),
    ("scene", ""),
    ("light", ""),
    ("policy", ""),
    ("K", ""),
    ("sessions", ""),
    ("viewers", ""),
    ("V", ""),
    ("used", "%"),
    ("one more viewer", "%"),
];
/// Characters of a scene's hash that tell scenes apart.
const SHORT_HASH: usize = 8;
const COLUMNS: [(&str, &str); 12] = [
    ("node", ""),
    ("roles", ""),
    ("plan", ""),
    ("g", "ms"),
    ("g_v", "ms"),
    ("c", "ms"),
    ("d", "ms"),
    ("e", "ms"),
    ("busy", "%"),
    ("views", ""),
    ("dropped", ""),
    ("device", ""),
];

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
        let text = text(&client.status().await?)?;
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
fn text(status: &ClusterStatus) -> anyhow::Result<String> {
    let mut workloads = Table::new(headline(status), &WORKLOAD_COLUMNS);
    for workload in &status.workloads {
        workloads.push(workload_row(workload))?;
    }
    let mut parts = vec![workloads.to_text()];
    for workload in &status.workloads {
        parts.push(workload_text(workload, &status.nodes)?);
    }
    let mut idle = Vec::new();
    for node in &status.nodes {
        if !status.workloads.iter().any(|workload| condition(workload, node).is_some()) {
            idle.push(node.node_name.as_str());
        }
    }
    if !idle.is_empty() {
        parts.push(format!("Nodes without a workload: {}.", idle.join(", ")));
    }
    Ok(parts.join("\n\n"))
}

fn headline(status: &ClusterStatus) -> String {
    format!(
        "Plan {}: P = {} nodes, K = {} samplers, V = {} views a set of {} sessions",
        status.plan_epoch,
        status.nodes.len(),
        status.sampler_count(),
        status.views_per_set(),
        status.session_count()
    )
}

fn workload_row(workload: &WorkloadStatus) -> Vec<Cell> {
    let WorkloadStatus { number, session_count, viewer_count, views_per_set, utilisation, one_more_viewer, .. } =
        workload;
    let plan = workload.plan.as_ref().map(|plan| {
        let shown = &plan.assignment.workload;
        let scene: String = shown.scene.hash.as_str().chars().take(SHORT_HASH).collect();
        let light = shown.lighting.clone();
        let policy = plan.assignment.policy.to_string();
        vec![scene.into(), light.into(), policy.into(), (plan.sampler_count() as f64).into()]
    });
    let head = [(*number as f64).into()].into_iter().chain(plan.unwrap_or_else(|| vec![Cell::Missing; 4]));
    let counts = [f64::from(*session_count), f64::from(*viewer_count), *views_per_set as f64].map(Cell::from);
    let used = utilisation.map_or(Cell::Missing, |utilisation| (utilisation * 100.0).into());
    head.chain(counts).chain([used, (one_more_viewer * 100.0).into()]).collect()
}

/// The nodes of a workload, its plan's reason, and what it achieves.
fn workload_text(workload: &WorkloadStatus, nodes: &[NodeStatus]) -> anyhow::Result<String> {
    let mut table = Table::new(format!("Workload {}", workload.number), &COLUMNS);
    for node in nodes {
        if let Some(condition) = condition(workload, node) {
            table.push(row(workload, node, condition))?;
        }
    }
    let why = workload.plan.as_ref().map_or("No plan: no node can serve it now.", |plan| &plan.reason);
    let promise = workload.promise.as_ref().map_or_else(String::new, |promise| format!("\n{promise}"));
    Ok(format!("{}\n\n{why}{promise}\n{}", table.to_text(), achieved(workload)))
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

fn row(workload: &WorkloadStatus, node: &NodeStatus, condition: &NodeCondition) -> Vec<Cell> {
    let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s, .. } = condition.costs;
    let times_ms = [sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s].map(|s| s * 1e3);
    let counts = [condition.busy_ratio * 100.0, condition.views as f64, condition.dropped_views as f64];
    let plan = if condition.is_ready { "ready" } else { "not yet" };
    let head = [node.node_name.clone().into(), roles(workload, &node.node_name).into(), plan.into()];
    let figures = times_ms.into_iter().chain(counts).map(Cell::from);
    head.into_iter().chain(figures).chain([node.device_name.clone().into()]).collect()
}

fn roles(workload: &WorkloadStatus, name: &str) -> String {
    let Some(plan) = &workload.plan else { return "-".to_owned() };
    let images = plan.assignment.samplers.iter().find(|share| share.node_name == name);
    let samples = images.map(|share| format!("samples {:?}", share.image_indices));
    let composites = plan.assignment.composites(name).then(|| "composites".to_owned());
    let roles: Vec<String> = samples.into_iter().chain(composites).collect();
    if roles.is_empty() { "-".to_owned() } else { roles.join(", ") }
}
