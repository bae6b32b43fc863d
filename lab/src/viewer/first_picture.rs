//! The first picture of a page before a cluster that serves already, and of a cluster that is started.

use std::time::{Duration, Instant};

use cluster::PolicyChoice;
use report::{Bar, Cell, Check, Table};

use super::page::Page;
use super::stand::{Ground, Stand};
use crate::process::Process;
use crate::section::Section;
use crate::statistics::median;

const SIZE_PX: [u32; 2] = [640, 360];
const WITHIN: Duration = Duration::from_secs(120);
const HAS_PICTURE: &str = "window.myriorama && window.myriorama.statistics.pictures.length > 0";
/// From the page's own start.
const FIRST_MS: &str = "window.myriorama.statistics.pictures[0].paintedAt";

/// # Errors
/// A process does not start, or no picture comes.
pub(super) async fn measure(ground: &Ground) -> anyhow::Result<Section> {
    let stand = Stand::start(ground, PolicyChoice::Pipeline).await?;
    stand.page(SIZE_PX).await?;
    let mut warm_s = Vec::new();
    for _ in 0..ground.repeats {
        let page = stand.page(SIZE_PX).await?;
        let first_ms: f64 = page.browser.value(FIRST_MS).await?;
        warm_s.push(first_ms / 1000.0);
    }
    let device = stand.processes.device.clone();
    drop(stand);
    let warm_s = median(warm_s);
    let cold_s = cold(ground).await?;
    let mut table = Table::new("The first picture of 640×360", &[("from", ""), ("time", "s")]);
    table.push([Cell::from("the start of a page"), warm_s.into()])?;
    table.push([Cell::from("the start of `myriorama up`"), cold_s.into()])?;
    let checks = vec![
        Check::new("first picture of a page", warm_s, "s", Bar::AtMost(1.0)),
        Check::new("first picture from the start of up", cold_s, "s", Bar::AtMost(15.0)),
    ];
    Ok(Section { device, tables: vec![table], checks })
}

/// The first picture after the start of a whole cluster, in a browser that is there already.
async fn cold(ground: &Ground) -> anyhow::Result<f64> {
    let page = Page::start(SIZE_PX).await?;
    let start = Instant::now();
    let device = ground.device.to_string();
    let mut up = Process::up_with_viewer(&["--scene", &ground.scene, "--device", &device])?;
    let _cluster = up.address()?;
    page.browser.open(&up.address()?).await?;
    page.browser.wait_until(HAS_PICTURE, WITHIN).await?;
    Ok(start.elapsed().as_secs_f64())
}
