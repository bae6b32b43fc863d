//! The time from the last input to the lossless still.

use std::time::Duration;

use cluster::PolicyChoice;
use report::{Bar, Cell, Check, Table};

use super::page::Page;
use super::stand::{Ground, Stand};
use crate::section::Section;
use crate::statistics::quantile;

const SIZE_PX: [u32; 2] = [640, 360];
/// Drags for each repeat.
const DRAGS: usize = 6;
const DRAG_S: f64 = 0.4;
const WITHIN: Duration = Duration::from_secs(20);

/// # Errors
/// A process does not start, or no still comes.
pub(super) async fn measure(ground: &Ground) -> anyhow::Result<Section> {
    let mut section = Section::default();
    let mut table = Table::new(
        "From the last input to the lossless still of 640×360",
        &[("policy", ""), ("median", "ms"), ("95 %", "ms")],
    );
    for policy in [PolicyChoice::Pipeline, PolicyChoice::Auto] {
        let stand = Stand::start(ground, policy).await?;
        let times_ms = stills(ground, &stand.page(SIZE_PX).await?).await?;
        let [median_ms, late_ms] = [0.5, 0.95].map(|share| quantile(times_ms.clone(), share));
        table.push([Cell::from(policy.to_string()), median_ms.into(), late_ms.into()])?;
        let name = format!("last input to still, {policy}");
        section.checks.push(Check::new(format!("{name}, median"), median_ms, "ms", Bar::AtMost(450.0)));
        section.checks.push(Check::new(format!("{name}, 95 %"), late_ms, "ms", Bar::AtMost(800.0)));
        section.device = stand.processes.device.clone();
    }
    section.tables.push(table);
    Ok(section)
}

async fn stills(ground: &Ground, page: &Page) -> anyhow::Result<Vec<f64>> {
    page.watch().await?;
    page.drag(DRAG_S).await?;
    let mut times_ms = Vec::new();
    for _ in 0..ground.repeats * DRAGS {
        page.wait_for_finished(WITHIN).await?;
        page.drag(DRAG_S).await?;
        page.wait_for_finished(WITHIN).await?;
        let last = "window.myriorama.statistics.pictures.findLast((p) => p.header.still
            && p.header.number === window.myriorama.number())";
        times_ms.push(page.browser.value(&format!("({last}).paintedAt - window.lastMove")).await?);
    }
    Ok(times_ms)
}
