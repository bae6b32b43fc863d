//! The costs by which the coordinator admits and plans, measured beside load and without.

use std::convert::Infallible;

use anyhow::Context as _;
use app_core::delivery::{open, receive, request};
use client::Client;
use cluster::{Costs, PolicyChoice, SessionRequest, Timeline};
use depth_image::PinholeCamera;
use report::{Bar, Cell, Check, Table};

use super::guests::{GUESTS, SMALL_PX};
use super::up::{Up, policies};
use super::viewer::{Viewer, path};
use crate::section::Section;
use crate::statistics::median;

/// The most that one is of the other.
const RATIO: f64 = 1.3;
/// Batches after which costs have settled: nodes time their own work.
const BATCHES: usize = 4;
/// Views of a batch.
const VIEWS: usize = 32;
/// The step between the near planes of two sessions: costs of a near plane that is known are not measured again.
const NEAR_STEP: f32 = 1e-3;

/// c and g_v of one session, and the policies in force.
struct Taken {
    costs: Costs,
    policies: String,
}

/// Measures the costs of sessions that differ in nothing that matters to them: in turn without load, and beside a viewer and
/// batches without end.
///
/// # Errors
/// The cluster does not start, or a session is refused.
pub(super) async fn measure(cluster: &[String], repeats: usize) -> anyhow::Result<Section> {
    let up = Up::start(cluster).await?;
    // All that is made once is made by the first.
    taken(&up, 0).await?;
    let mut pairs = Vec::with_capacity(repeats);
    for repeat in 0..repeats {
        let idle = taken(&up, 2 * repeat + 1).await?;
        pairs.push([idle, beside(&up, 2 * repeat + 2).await?]);
    }
    section(&pairs, up.device.clone())
}

async fn beside(up: &Up, number: usize) -> anyhow::Result<Taken> {
    let viewer = Viewer::start(&up.coordinator, up.offer()?, PolicyChoice::Pipeline).await?;
    let taken = tokio::select! {
        taken = taken(up, number) => taken,
        Err(error) = batches(up) => Err(error),
    };
    viewer.stop(0.0).await?;
    taken
}

/// Asks for one batch after the other.
async fn batches(up: &Up) -> anyhow::Result<Infallible> {
    loop {
        GUESTS[0].visit(&up.coordinator, up.two_offers()?).await?;
    }
}

/// The costs of a workload of its own, once they have settled.
async fn taken(up: &Up, number: usize) -> anyhow::Result<Taken> {
    let offer = up.offer()?;
    let client = Client::connect(&up.coordinator).await?;
    let near = |view: PinholeCamera| PinholeCamera { near_m: view.near_m * (1.0 + NEAR_STEP * number as f32), ..view };
    let views: Vec<PinholeCamera> = path(offer, VIEWS, SMALL_PX)?.into_iter().map(near).collect();
    let request = SessionRequest {
        timeline: Timeline::still(1e-3 * (number + 1) as f64),
        ..request(offer.settings.clone(), PolicyChoice::Pipeline, &views)?
    };
    let session = open(&client, request).await?;
    for _ in 0..BATCHES {
        receive(&session, &views, async |_| Ok(())).await?;
    }
    let own = session.plan().assignment.workload_number;
    let workloads = client.status().await?.workloads;
    let workload = workloads.into_iter().find(|workload| workload.number == own).context("the workload has ended")?;
    let of = |figure: fn(&Costs) -> f64| median(workload.conditions.iter().map(|node| figure(&node.costs)).collect());
    let costs = Costs {
        reconstruct_view_s: of(|costs| costs.reconstruct_view_s),
        direct_view_s: of(|costs| costs.direct_view_s),
        ..Costs::default()
    };
    Ok(Taken { costs, policies: policies(&up.coordinator).await? })
}

/// Each pair is of a session without load and one beside it.
fn section(pairs: &[[Taken; 2]], device: String) -> anyhow::Result<Section> {
    let columns = [("cost", ""), ("policy", ""), ("idle", "ms"), ("beside load", "ms"), ("beside over idle", "")];
    let mut table = Table::new("Costs beside load", &columns);
    let mut checks = Vec::new();
    let policies = pairs.first().map_or_else(String::new, |[_, beside]| beside.policies.clone());
    for (at, name) in ["c", "g_v"].into_iter().enumerate() {
        let of = |taken: &Taken| [taken.costs.reconstruct_view_s, taken.costs.direct_view_s][at];
        let middle =
            |figure: fn([f64; 2]) -> f64| median(pairs.iter().map(|pair| figure(pair.each_ref().map(of))).collect());
        let ratio = middle(|[idle_s, beside_s]| beside_s / idle_s);
        let numbers = [middle(|pair| pair[0] * 1e3), middle(|pair| pair[1] * 1e3), ratio].map(Cell::from);
        table.push([Cell::from(name), policies.clone().into()].into_iter().chain(numbers))?;
        let name = format!("{name} taken beside load and idle, the greater over the smaller");
        checks.push(Check::new(name, ratio.max(ratio.recip()), "", Bar::AtMost(RATIO)));
    }
    Ok(Section { device, tables: vec![table], checks })
}
