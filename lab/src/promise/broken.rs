//! A promise of wrong measurements: the time until it is said to be broken and something else is in force.

use std::time::{Duration, Instant};

use cluster::{PolicyChoice, PromiseState};
use report::{Bar, Cell, Check, Table};

use super::forged::forge;
use super::live_viewer::{Asked, Cluster, Viewer};
use crate::section::Section;

const SCENE: &str = "courtyard";
/// The honest budget, for which measurements are made first.
const BUDGET: &str = "flip 0.05";
const RATE_HZ: f64 = 10.0;
/// The longest time that is waited for, and the time after it.
const LONGEST_S: f64 = 120.0;
const AFTER: Duration = Duration::from_secs(10);
const LOOK: Duration = Duration::from_millis(20);
const SHARE: &str = "0.2";

/// Makes honest measurements, divides their errors by three, and follows a viewer of a cluster that believes them.
///
/// # Errors
/// A cluster does not start, or nothing keeps the budget.
pub(super) async fn measure() -> anyhow::Result<Section> {
    let [honest, forged] = [tempfile::tempdir()?, tempfile::tempdir()?];
    let cluster = Cluster::start(SCENE, honest.path(), &[]).await?;
    cluster.viewer(asked(&cluster, BUDGET, PolicyChoice::Pipeline)?).await?.kept().await?;
    // Measurements are written beside the promise.
    tokio::time::sleep(Duration::from_secs(2)).await;
    drop(cluster);
    let budget = forge(honest.path(), forged.path())?;
    let cluster = Cluster::start(SCENE, forged.path(), &["--audit", SHARE, "--direct-share", SHARE]).await?;
    let viewer = cluster.viewer(asked(&cluster, &budget, PolicyChoice::Auto)?).await?;
    let promised = viewer.kept().await?.representation;
    let mut found = None;
    let start = Instant::now();
    let stop = async {
        replaced_by_audits(&viewer, promised.clone()).await;
        found = Some(start.elapsed().as_secs_f64());
        tokio::time::sleep(AFTER).await;
    };
    let record = viewer.follow(RATE_HZ, LONGEST_S, stop).await?;
    let (is_said, replaced_s) = (found.is_some(), found.unwrap_or(f64::INFINITY));
    let (longest_gap_s, _) = record.longest_gap_s(0.0);
    let after = viewer.promise().map_or_else(String::new, |promise| promise.to_string());
    section(cluster.device.clone(), [budget, promised, after], (is_said, replaced_s, longest_gap_s))
}

fn asked<'a>(cluster: &Cluster, budget: &'a str, policy: PolicyChoice) -> anyhow::Result<Asked<'a>> {
    Ok(Asked { budget: Some(budget), policy, rate_hz: RATE_HZ, path: cluster.orbit()?, has_cells: false })
}

/// Waits until another representation is in force since audits found a promise broken, as the viewer is told. Direct drawing
/// may be in force before anybody looks.
pub(super) async fn replaced_by_audits(viewer: &Viewer, mut promised: String) {
    loop {
        if let Some(promise) = viewer.promise() {
            let is_other = promise.state == PromiseState::Kept && promise.representation != promised;
            if is_other && promise.reason.contains("Audits found") {
                return;
            }
            // Another choice for another reason is no finding.
            if is_other {
                promised = promise.representation;
            }
        }
        tokio::time::sleep(LOOK).await;
    }
}

fn section(
    device: String,
    [budget, promised, after]: [String; 3],
    (is_said, replaced_s, longest_gap_s): (bool, f64, f64),
) -> anyhow::Result<Section> {
    let columns =
        [("budget", ""), ("promised", ""), ("another in force after", "s"), ("longest gap", "s"), ("then", "")];
    let mut table = Table::new("courtyard: errors of measurements divided by three", &columns);
    let row = [Cell::from(budget), promised.into(), replaced_s.into(), longest_gap_s.into(), after.into()];
    table.push(row)?;
    let checks = vec![
        Check::new("the finding is said", f64::from(u8::from(is_said)), "", Bar::AtLeast(1.0)),
        Check::new("another representation in force after", replaced_s, "s", Bar::AtMost(30.0)),
        Check::new("longest gap", longest_gap_s, "s", Bar::AtMost(1.0)),
    ];
    Ok(Section { device, tables: vec![table], checks })
}
