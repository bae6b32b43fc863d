//! A viewer that goes around the scene to its back: with fixed sample cameras, and with view cells on its way.

use std::time::{Duration, Instant};

use cluster::{PolicyChoice, Promise, PromiseState};
use report::{Bar, Cell, Check, Table};

use super::broken::replaced_by_audits;
use super::live_viewer::{Asked, Cluster, Viewer};
use crate::section::Section;

const SCENE: &str = "courtyard";
const BUDGET: &str = "flip 0.05";
const RATE_HZ: f64 = 10.0;
/// The way takes 10 s; the viewer then stays about the back.
const POSES_OF_THE_WAY: usize = 100;
const MEASURED_S: f64 = 60.0;
/// The time after another representation is in force.
const AFTER: Duration = Duration::from_secs(10);
const SHARE: &str = "0.2";
const AUDITED: [&str; 4] = ["--audit", SHARE, "--direct-share", SHARE];

/// What a viewer has seen.
struct Walked {
    /// From the start to another representation, if audits found the promise broken.
    replaced_s: Option<f64>,
    longest_gap_s: f64,
    shown: usize,
    /// Views that were audited since the last representation is in force.
    audited: u64,
    promise: Option<Promise>,
}

/// Both ways.
///
/// # Errors
/// A cluster does not start, or nothing keeps the budget.
pub(super) async fn measure() -> anyhow::Result<Section> {
    let mut section = Section::default();
    let columns = [
        ("sample cameras", ""),
        ("poses shown", ""),
        ("longest gap", "s"),
        ("audited views", ""),
        ("broken and replaced after", "s"),
        ("then", ""),
    ];
    let mut table = Table::new(format!("{SCENE}: 10 s to the back and a stay there, {BUDGET}"), &columns);
    for (name, has_cells) in [("fixed", false), ("of view cells on the way", true)] {
        let plans = tempfile::tempdir()?;
        let cluster = Cluster::start(SCENE, plans.path(), &AUDITED).await?;
        section.device.clone_from(&cluster.device);
        let path = cluster.to_the_back(POSES_OF_THE_WAY, (MEASURED_S * RATE_HZ) as usize)?;
        let asked = Asked { budget: Some(BUDGET), policy: PolicyChoice::Auto, rate_hz: RATE_HZ, path, has_cells };
        let walked = walk(&cluster, &cluster.viewer(asked).await?).await?;
        let replaced_s = walked.replaced_s.map_or_else(|| "never".to_owned(), |seconds| format!("{seconds:.1}"));
        let then = walked.promise.as_ref().map_or_else(String::new, ToString::to_string);
        let numbers = [walked.shown as f64, walked.longest_gap_s, walked.audited as f64].map(Cell::from);
        table.push([Cell::from(name)].into_iter().chain(numbers).chain([replaced_s.into(), then.into()]))?;
        section.checks.extend(checks(has_cells, &walked));
    }
    section.tables.push(table);
    Ok(section)
}

/// Follows the viewer's path until audits have had its promise replaced, or to its end.
async fn walk(cluster: &Cluster, viewer: &Viewer) -> anyhow::Result<Walked> {
    let promised = viewer.kept().await?.representation;
    let (start, mut replaced_s) = (Instant::now(), None);
    let stop = async {
        replaced_by_audits(viewer, promised).await;
        replaced_s = Some(start.elapsed().as_secs_f64());
        tokio::time::sleep(AFTER).await;
    };
    let record = viewer.follow(RATE_HZ, MEASURED_S, stop).await?;
    let (longest_gap_s, _) = record.longest_gap_s(0.0);
    // Sessions are told of figures now and then.
    let promise = cluster.promise().await?;
    let audited = promise.as_ref().and_then(|promise| promise.audit).map_or(0, |audit| audit.audited_views);
    Ok(Walked { replaced_s, longest_gap_s, shown: record.shown.len(), audited, promise })
}

fn checks(has_cells: bool, walked: &Walked) -> Vec<Check> {
    let name = if has_cells { "view cells" } else { "fixed sample cameras" };
    let gap = Check::new(format!("{name}: longest gap"), walked.longest_gap_s, "s", Bar::AtMost(1.0));
    let found = match has_cells {
        true => {
            let is_broken =
                |promise: &Promise| promise.state == PromiseState::Broken || promise.reason.contains("Audits found");
            let is_alarmed = walked.replaced_s.is_some() || walked.promise.as_ref().is_some_and(is_broken);
            let alarms = f64::from(u8::from(is_alarmed));
            vec![
                Check::new(format!("{name}: broken promises"), alarms, "", Bar::AtMost(0.0)),
                Check::new(format!("{name}: audited views"), walked.audited as f64, "", Bar::AtLeast(1.0)),
            ]
        }
        false => {
            let replaced_s = walked.replaced_s.unwrap_or(f64::INFINITY);
            vec![Check::new(format!("{name}: broken and replaced after"), replaced_s, "s", Bar::AtMost(30.0))]
        }
    };
    [gap].into_iter().chain(found).collect()
}
