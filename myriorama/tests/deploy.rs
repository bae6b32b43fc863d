//! Deployed files fit the program: metrics of the dashboard exist, and commands of the compose file are valid.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::path::Path;

use clap::Parser as _;
use cluster::{ClusterStatus, SharedLightCosts, WorkloadStatus};
use coordinator::CoordinatorMetrics;
use node::{NodeMetrics, Telemetry};

fn deployed(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy").join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn names_in(text: &str) -> BTreeSet<String> {
    let is_part = |c: char| c.is_ascii_lowercase() || c == '_' || c.is_ascii_digit();
    let starts = text.match_indices("myriorama_").map(|(at, _)| &text[at..]);
    starts.map(|rest| rest.chars().take_while(|&c| is_part(c)).collect()).collect()
}

#[test]
fn every_metric_of_the_dashboard_is_exported() {
    let telemetry = Telemetry::default();
    let node = NodeMetrics::new(&telemetry);
    let coordinator = CoordinatorMetrics::new(&telemetry);
    node.drop_view("client gone");
    let shared_light = Some(SharedLightCosts { known_ratio: 0.9, surfaces_s: 0.1, look_up_s: 0.02, unknown_s: 0.3 });
    let workloads = vec![WorkloadStatus { shared_light, ..WorkloadStatus::default() }];
    coordinator.show(&ClusterStatus { workloads, ..ClusterStatus::default() }, &[]);
    let exported = names_in(&telemetry.page());
    let shown = names_in(&deployed("grafana/dashboard.json"));
    assert!(shown.len() > 10, "{shown:?}");
    let unknown: Vec<_> = shown.difference(&exported).collect();
    assert!(unknown.is_empty(), "{unknown:?} are not among {exported:?}");
}

/// A word with the default of its variable: `${NAME:-default}`.
fn default_of(word: &str) -> String {
    match word.split_once("${").and_then(|(before, rest)| Some((before, rest.split_once(":-")?.1))) {
        Some((before, default)) => format!("{before}{}", default.trim_end_matches('}')),
        None => word.to_owned(),
    }
}

/// The `- --flag=value` lists of a service, as the shell would pass them.
fn commands_in(compose: &str) -> Vec<Vec<String>> {
    let mut commands: Vec<Vec<String>> = Vec::new();
    let mut inside = false;
    for line in compose.lines().map(str::trim) {
        if line == "command:" {
            commands.push(vec!["myriorama".to_owned()]);
            inside = true;
        } else if let Some(word) = line.strip_prefix("- ").filter(|_| inside) {
            commands.last_mut().unwrap().push(default_of(word));
        } else {
            inside = false;
        }
    }
    commands
}

#[test]
fn every_command_of_the_compose_file_is_valid() {
    let commands = commands_in(&deployed("compose.yaml"));
    assert_eq!(commands.len(), 3, "{commands:?}");
    for command in commands {
        if let Err(error) = myriorama::cli::Cli::try_parse_from(&command) {
            panic!("{command:?}: {error}");
        }
    }
}
