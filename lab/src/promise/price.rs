//! What audits and planning cost a viewer: views a second and the age of frames, in turn with the same without.

use std::future::pending;
use std::path::Path;
use std::time::Duration;

use cluster::PolicyChoice;
use report::{Bar, Cell, Check, Table};
use scene::SceneSpec;

use super::live_viewer::{Asked, Cluster, Viewer};
use crate::section::Section;
use crate::statistics::{median, quantile};

/// A budget that cheap representations keep.
const BUDGET: &str = "flip 0.2";
/// Poses a second: more than are shown, so that views a second are the cluster's.
const RATE_HZ: f64 = 100.0;
/// Seconds of a measurement, and those before it in which shaders are built.
const MEASURED_S: f64 = 30.0;
const WARM_S: f64 = 5.0;
const AUDIT: f64 = 0.01;

/// What a viewer has, in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Arrangement {
    /// A plan is there, and nothing is audited.
    Unaudited,
    /// The same with audits for 1 % of the time.
    Audited,
    /// No budget.
    Unplanned,
    /// A plan is being made, from nothing.
    Planning,
}

const ARRANGEMENTS: [(Arrangement, &str); 4] = [
    (Arrangement::Unaudited, "a promise without audits"),
    (Arrangement::Audited, "a promise with audits"),
    (Arrangement::Unplanned, "no budget"),
    (Arrangement::Planning, "while a plan is made"),
];

/// The figures of one measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    views_per_s: f64,
    age_s: f64,
    /// Audits' time, over the share that they may take.
    audited_share: f64,
}

/// All arrangements in turn, for each scene.
///
/// # Errors
/// A cluster does not start, or nothing keeps the budget.
pub(super) async fn measure(scenes: &[SceneSpec], alternations: usize) -> anyhow::Result<Section> {
    let mut section = Section::default();
    for scene in scenes {
        let plans = tempfile::tempdir()?;
        let name = scene.to_string();
        // The plan is made while nobody watches.
        let cluster = Cluster::start(&name, plans.path(), &[]).await?;
        section.device.clone_from(&cluster.device);
        viewer(&cluster, Some(BUDGET)).await?.kept().await?;
        drop(cluster);
        let mut seen: [Vec<Seen>; 4] = Default::default();
        for _ in 0..alternations {
            for (seen, (arrangement, _)) in seen.iter_mut().zip(ARRANGEMENTS) {
                seen.push(seen_in(arrangement, &name, plans.path()).await?);
            }
        }
        add(&mut section, &name, &seen)?;
    }
    Ok(section)
}

async fn viewer(cluster: &Cluster, budget: Option<&str>) -> anyhow::Result<Viewer> {
    let (policy, path) = (PolicyChoice::Pipeline, cluster.orbit()?);
    cluster.viewer(Asked { budget, policy, rate_hz: RATE_HZ, path, has_cells: false }).await
}

async fn seen_in(arrangement: Arrangement, scene: &str, plans: &Path) -> anyhow::Result<Seen> {
    let empty = tempfile::tempdir()?;
    let (plans, audit) = match arrangement {
        Arrangement::Planning => (empty.path(), "0"),
        Arrangement::Audited => (plans, "0.01"),
        Arrangement::Unaudited | Arrangement::Unplanned => (plans, "0"),
    };
    let budget = (arrangement != Arrangement::Unplanned).then_some(BUDGET);
    let cluster = Cluster::start(scene, plans, &["--audit", audit]).await?;
    let viewer = viewer(&cluster, budget).await?;
    if matches!(arrangement, Arrangement::Audited | Arrangement::Unaudited) {
        viewer.kept().await?;
    }
    viewer.follow(RATE_HZ, WARM_S, pending::<()>()).await?;
    let before_s = cluster.audit_s().await?;
    let record = viewer.follow(RATE_HZ, MEASURED_S, pending::<()>()).await?;
    // The last report of the work.
    tokio::time::sleep(Duration::from_secs(2)).await;
    let ages_s = record.shown.iter().map(|shown| shown.age_s()).collect();
    Ok(Seen {
        views_per_s: record.shown.len() as f64 / record.seconds,
        age_s: quantile(ages_s, 0.99),
        audited_share: (cluster.audit_s().await? - before_s) / (AUDIT * record.seconds),
    })
}

fn add(section: &mut Section, scene: &str, seen: &[Vec<Seen>; 4]) -> anyhow::Result<()> {
    let columns =
        [("viewer", ""), ("views", "1/s"), ("age of frames, 99 %", "ms"), ("audits of what they may take", "%")];
    let mut table = Table::new(format!("{scene}: medians of {} alternations", seen[0].len()), &columns);
    let of = |seen: &[Seen], figure: fn(&Seen) -> f64| median(seen.iter().map(figure).collect());
    let [views, ages, shares]: [fn(&Seen) -> f64; 3] = [|s| s.views_per_s, |s| s.age_s, |s| s.audited_share];
    for (seen, (_, name)) in seen.iter().zip(ARRANGEMENTS) {
        let numbers = [of(seen, views), of(seen, ages) * 1e3, of(seen, shares) * 100.0];
        table.push([Cell::from(name)].into_iter().chain(numbers.map(Cell::from)))?;
    }
    section.tables.push(table);
    let ratio = |of_what: usize, over: usize, figure| of(&seen[of_what], figure) / of(&seen[over], figure);
    let check = |what: &str, value, bar| Check::new(format!("{scene}: {what}"), value, "", bar);
    section.checks.extend([
        check("views a second with audits over without", ratio(1, 0, views), Bar::AtLeast(0.97)),
        check("age of frames with audits over without", ratio(1, 0, ages), Bar::AtMost(1.25)),
        check("audits of what they may take", of(&seen[1], shares), Bar::AtLeast(0.8)),
        check("views a second while planning over without a budget", ratio(3, 2, views), Bar::AtLeast(0.7)),
        check("age of frames while planning over without a budget", ratio(3, 2, ages), Bar::AtMost(3.0)),
    ]);
    Ok(())
}
