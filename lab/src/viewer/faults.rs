//! A compositor is killed, then the gateway, while a visitor drags.

use std::time::Duration;

use anyhow::Context as _;
use cluster::PolicyChoice;
use report::{Bar, Cell, Check, Table};

use super::page::longest_gap_s;
use super::stand::{Ground, Stand};
use crate::section::Section;

const SIZE_PX: [u32; 2] = [320, 180];
const WITHIN: Duration = Duration::from_secs(30);
/// Seconds of a drag after a compositor is killed.
const AFTER_S: f64 = 8.0;
/// The time for which there is no gateway.
const AWAY: Duration = Duration::from_secs(3);
/// Notes when the banner appears.
const WATCH_BANNER: &str = "window.bannerAt = null;
    const banner = document.getElementById('banner');
    new MutationObserver(() => { if (!banner.hidden) window.bannerAt ??= performance.now(); })
        .observe(banner, { attributes: true });
    return null";

/// # Errors
/// A process does not start, or no picture comes back.
pub(super) async fn measure(ground: &Ground) -> anyhow::Result<Section> {
    let gap_s = killed_compositor(ground).await?;
    let mut stand = Stand::start(ground, PolicyChoice::Pipeline).await?;
    let (banner_s, back_s) = killed_gateway(&mut stand).await?;
    let mut table = Table::new("Faults while a visitor drags", &[("fault", ""), ("figure", ""), ("time", "s")]);
    table.push([Cell::from("a compositor is killed"), "longest gap".into(), gap_s.into()])?;
    table.push([Cell::from("the gateway is killed"), "until the banner".into(), banner_s.into()])?;
    table.push([Cell::from("the gateway is back"), "until a picture".into(), back_s.into()])?;
    let checks = vec![
        Check::new("a compositor killed: longest gap", gap_s, "s", Bar::AtMost(2.0)),
        Check::new("the gateway killed: until the banner", banner_s, "s", Bar::AtMost(1.0)),
        Check::new("the gateway back: until a picture", back_s, "s", Bar::AtMost(2.0)),
    ];
    Ok(Section { device: stand.processes.device.clone(), tables: vec![table], checks })
}

async fn killed_compositor(ground: &Ground) -> anyhow::Result<f64> {
    let mut stand = Stand::start(ground, PolicyChoice::Pipeline).await?;
    let page = stand.page(SIZE_PX).await?;
    page.drag(3.0).await?;
    let victim: String = page.browser.value("window.myriorama.statistics.pictures.at(-1).header.compositor").await?;
    let index = page.picture_count().await?;
    let since_ms = page.now_ms().await?;
    stand.processes.kill(&victim);
    page.drag(AFTER_S).await?;
    let until_ms = page.now_ms().await?;
    Ok(longest_gap_s(&page.pictures_since(index).await?, since_ms, until_ms))
}

/// Seconds until the banner, and from the new gateway's start to a picture.
async fn killed_gateway(stand: &mut Stand) -> anyhow::Result<(f64, f64)> {
    let page = stand.page(SIZE_PX).await?;
    page.drag(1.0).await?;
    page.wait_for_finished(WITHIN).await?;
    page.browser.run::<()>(WATCH_BANNER, Vec::new()).await?;
    let index = page.picture_count().await?;
    let killed_ms = page.now_ms().await?;
    stand.restart_gateway(AWAY).await?;
    let back_ms = page.now_ms().await?;
    let has_more = format!("window.myriorama.statistics.pictures.length > {index}");
    page.browser.wait_until(&has_more, WITHIN).await?;
    let picture = page.pictures_since(index).await?.into_iter().next().context("a picture")?;
    let banner_ms: Option<f64> = page.browser.value("window.bannerAt").await?;
    let banner_ms = banner_ms.unwrap_or(f64::INFINITY);
    Ok(((banner_ms - killed_ms) / 1000.0, (picture.painted_ms - back_ms) / 1000.0))
}
