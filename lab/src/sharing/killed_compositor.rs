//! Viewers of two scenes on processes of their own, while a compositor of one scene is killed.

use std::time::Duration;

use anyhow::Context as _;
use client::Client;
use cluster::PolicyChoice;
use gpu::DevicePreference;
use report::{Bar, Cell, Check, Table};

use super::up::policies;
use super::viewer::{Viewer, Watched};
use crate::processes::{Processes, Setting, Share};
use crate::section::Section;

/// The longest time without a new frame of the other scene.
const LONGEST_GAP_S: f64 = 0.5;
/// The scene whose compositor is killed, and the other one.
const SCENES: [&str; 2] = ["courtyard", "mirror-hall"];
/// Viewers of each scene.
const VIEWERS: usize = 2;
const NODES: usize = 4;
/// The time before the compositor is killed, and the time after.
const BEFORE: Duration = Duration::from_secs(15);
const AFTER: Duration = Duration::from_secs(45);

/// Measures the gaps of all viewers.
///
/// # Errors
/// A process does not start, or the frames of a viewer end.
pub(super) async fn measure(device: DevicePreference) -> anyhow::Result<Section> {
    let coordinator = SCENES.iter().flat_map(|scene| ["--scene", scene].map(str::to_owned)).collect();
    let mut processes = Processes::start(&Setting { coordinator, device, nodes: NODES, share: Share::Whole }).await?;
    let offers = Client::connect(&processes.address).await?.status().await?.offers;
    let mut viewers = Vec::new();
    for offer in offers.iter().cycle().take(SCENES.len() * VIEWERS) {
        viewers.push(Viewer::start(&processes.address, offer, PolicyChoice::Pipeline).await?);
    }
    tokio::time::sleep(BEFORE).await;
    let policies = policies(&processes.address).await?;
    let victim = victim(&viewers)?;
    let since_s: Vec<f64> = viewers.iter().map(Viewer::now_s).collect();
    processes.kill(&victim);
    tokio::time::sleep(AFTER).await;
    let mut watched = Vec::new();
    for (viewer, since_s) in viewers.into_iter().zip(since_s) {
        watched.push(viewer.stop(since_s).await?);
    }
    section(&watched, &policies, processes.device.clone())
}

/// A compositor of the first scene, and of no other where there is one.
fn victim(viewers: &[Viewer]) -> anyhow::Result<String> {
    let own = viewers[0].plan();
    let other = viewers[1].plan();
    let mut names = own.compositors.iter().map(|share| &share.node_name);
    let only_here = names
        .clone()
        .find(|&name| !other.composites(name) && other.samplers.iter().all(|share| share.node_name != *name));
    only_here.or_else(|| names.next()).cloned().context("the plan has no compositor")
}

fn section(watched: &[Watched], policies: &str, device: String) -> anyhow::Result<Section> {
    let columns = [("scene", ""), ("policy", ""), ("longest gap", "s"), ("poses shown, fewest", "%")];
    let mut table = Table::new("A compositor of courtyard is killed", &columns);
    let mut gaps_s = [0.0; 2];
    for (at, scene) in SCENES.into_iter().enumerate() {
        let own = watched.iter().skip(at).step_by(SCENES.len());
        gaps_s[at] = own.clone().map(|watched| watched.longest_gap_s).fold(0.0, f64::max);
        let shown = own.map(|watched| watched.shown_share).fold(1.0, f64::min);
        let numbers = [gaps_s[at], shown * 100.0].map(Cell::from);
        table.push([Cell::from(scene), policies.into()].into_iter().chain(numbers))?;
    }
    let name = "a compositor of courtyard killed: longest gap of mirror-hall";
    let checks = vec![Check::new(name, gaps_s[1], "s", Bar::AtMost(LONGEST_GAP_S))];
    Ok(Section { device, tables: vec![table], checks })
}
