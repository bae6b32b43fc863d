//! `myriorama status`: the state of a cluster as a table of nodes, roles and costs, and the reason of the plan.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;
use app_core::exit::Outcome;
use clap::Args;
use client::Client;
use cluster::{ClusterStatus, Costs, NodeStatus};
use table::{Cell, Table};

use crate::terminal_picture;

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

/// Prints the nodes of a cluster with their roles and costs, the plan and its reason.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// The address of the coordinator
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:7420", env = "MYRIORAMA_COORDINATOR")]
    coordinator: String,
    /// Repeats every S seconds until ctrl-c
    #[arg(long, value_name = "S", num_args = 0..=1, default_missing_value = "1")]
    watch: Option<f64>,
    /// Writes the text as a picture as well (SVG)
    #[arg(long, value_name = "FILE", conflicts_with = "watch")]
    picture: Option<PathBuf>,
}

/// Asks and prints.
///
/// # Errors
/// The coordinator does not answer.
pub async fn run(args: &StatusArgs) -> anyhow::Result<Outcome> {
    let client =
        Client::connect(&args.coordinator).await.with_context(|| format!("no coordinator at {}", args.coordinator))?;
    loop {
        let text = text(&client.status().await?)?;
        let Some(seconds) = args.watch else {
            if let Some(file) = &args.picture {
                let written = std::fs::write(file, terminal_picture::svg(&text));
                written.with_context(|| format!("cannot write {}", file.display()))?;
            }
            println!("{text}");
            return Ok(Outcome::Done);
        };
        // The terminal is cleared, so that the table stays in place.
        println!("\x1b[2J\x1b[H{text}");
        tokio::time::sleep(Duration::from_secs_f64(seconds.clamp(0.1, 3600.0))).await;
    }
}

fn text(status: &ClusterStatus) -> anyhow::Result<String> {
    let mut table = Table::new(headline(status), &COLUMNS);
    for node in &status.nodes {
        table.push(row(status, node))?;
    }
    let why = status.plan.as_ref().map_or("No plan: nobody has asked for views.", |plan| &plan.reason);
    Ok(format!("{}\n\n{why}\n{}", table.to_text(), achieved(status)))
}

/// Times that policies achieved, and the load of the nodes.
fn achieved(status: &ClusterStatus) -> String {
    let mut lines: Vec<String> =
        status.achieved.iter().map(|a| format!("Achieved by {}: {:.3} ms a set.", a.policy, a.busy_s * 1e3)).collect();
    if let Some(utilisation) = status.utilisation {
        let fallback = status.plan.as_ref().and_then(|plan| plan.fallback);
        let quality = fallback.map_or("all that was asked for".to_owned(), |number| format!("fallback {number}"));
        lines.push(format!("Sessions take {:.0} % of the nodes' time and get {quality}.", utilisation * 100.0));
    }
    lines.join("\n")
}

fn headline(status: &ClusterStatus) -> String {
    let ClusterStatus { plan_epoch, nodes, session_count, views_per_set, .. } = status;
    let (p, k) = (nodes.len(), status.plan.as_ref().map_or(0, |plan| plan.sampler_count()));
    format!(
        "Plan {plan_epoch}: P = {p} nodes, K = {k} samplers, V = {views_per_set} views a set of {session_count} sessions"
    )
}

fn row(status: &ClusterStatus, node: &NodeStatus) -> Vec<Cell> {
    let condition = status.conditions.iter().find(|condition| condition.node_name == node.node_name);
    let plan = condition.map_or("-", |condition| if condition.is_ready { "ready" } else { "not yet" });
    let figures = condition.map(|condition| {
        let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s, .. } =
            condition.costs;
        let times_ms = [sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, encode_view_s].map(|s| s * 1e3);
        let counts = [condition.busy_ratio * 100.0, condition.views as f64, condition.dropped_views as f64];
        times_ms.into_iter().chain(counts).map(Cell::from).collect()
    });
    let head = [node.node_name.clone().into(), roles(status, &node.node_name).into(), plan.into()];
    let figures = figures.unwrap_or_else(|| vec![Cell::Missing; 8]);
    head.into_iter().chain(figures).chain([node.device_name.clone().into()]).collect()
}

fn roles(status: &ClusterStatus, name: &str) -> String {
    let Some(plan) = &status.plan else { return "-".to_owned() };
    let images = plan.assignment.samplers.iter().find(|share| share.node_name == name);
    let samples = images.map(|share| format!("samples {:?}", share.image_indices));
    let composites = plan.assignment.composites(name).then(|| "composites".to_owned());
    let roles: Vec<String> = samples.into_iter().chain(composites).collect();
    if roles.is_empty() { "-".to_owned() } else { roles.join(", ") }
}
