//! A slow link to the gateway, which is then freed.

use std::time::Duration;

use cluster::PolicyChoice;
use network_proxy::{Proxy, Way};
use report::{Bar, Cell, Check, Table};

use super::page::{Page, Picture};
use super::stand::{Ground, Stand, authority};
use crate::section::Section;
use crate::statistics::median_of;

const SIZE_PX: [u32; 2] = [640, 360];
/// 1 Mbit/s each way, with a round trip of 80 ms.
const LINK: Way = Way::Link { bytes_per_s: 125_000.0, delay: Duration::from_millis(40) };
/// Seconds of a drag over the slow link; the first ones find the size.
const DRAG_S: f64 = 20.0;
const FOUND_S: f64 = 5.0;
/// The longest time until pictures have their full size again.
const FREED_S: f64 = 8.0;
const WITHIN: Duration = Duration::from_secs(120);

/// # Errors
/// A process does not start, or no picture comes.
pub(super) async fn measure(ground: &Ground) -> anyhow::Result<Section> {
    let stand = Stand::start(ground, PolicyChoice::Pipeline).await?;
    // Once without the link: shaders are compiled.
    stand.page(SIZE_PX).await?.drag(3.0).await?;
    let proxy = Proxy::to(&format!("http://{}", authority(&stand.url)), 1);
    proxy.set(LINK, LINK);
    let page = Page::start(SIZE_PX).await?;
    page.browser.open(&proxy.address).await?;
    page.wait_for_finished(WITHIN).await?;
    let start_ms = page.now_ms().await? + FOUND_S * 1000.0;
    let pictures = page.drag(DRAG_S).await?;
    let slow: Vec<Picture> = pictures.into_iter().filter(|picture| picture.painted_ms > start_ms).collect();
    proxy.set(Way::Pass, Way::Pass);
    let freed_ms = page.now_ms().await?;
    let freed = page.drag(FREED_S + 4.0).await?;
    let checked = Slow::of(&slow, &freed, freed_ms);
    section(&checked, stand.processes.device.clone())
}

struct Slow {
    per_s: f64,
    age_ms: f64,
    /// The median age of the second half over that of the first.
    rise: f64,
    /// Until the first picture of the canvas's own height.
    full_s: f64,
}

impl Slow {
    fn of(slow: &[Picture], freed: &[Picture], freed_ms: f64) -> Self {
        let (first, second) = slow.split_at(slow.len() / 2);
        let full = freed.iter().find(|picture| picture.size_px[1] >= SIZE_PX[1]);
        Self {
            per_s: slow.len() as f64 / (DRAG_S - FOUND_S),
            age_ms: median_of(slow, |picture| picture.age_ms),
            rise: median_of(second, |picture| picture.age_ms) / median_of(first, |picture| picture.age_ms),
            full_s: full.map_or(f64::INFINITY, |picture| (picture.painted_ms - freed_ms) / 1000.0),
        }
    }
}

fn section(slow: &Slow, device: String) -> anyhow::Result<Section> {
    let mut table = Table::new(
        "A link of 1 Mbit/s with a round trip of 80 ms",
        &[
            ("pictures a second", ""),
            ("age, median", "ms"),
            ("second half over first", ""),
            ("full size after it is freed", "s"),
        ],
    );
    table.push([slow.per_s, slow.age_ms, slow.rise, slow.full_s].map(Cell::from))?;
    let checks = vec![
        Check::new("slow link: pictures a second", slow.per_s, "", Bar::AtLeast(5.0)),
        Check::new("slow link: age, median", slow.age_ms, "ms", Bar::AtMost(450.0)),
        Check::new("slow link: age of the second half over the first", slow.rise, "", Bar::AtMost(1.25)),
        Check::new("slow link: full size after it is freed", slow.full_s, "s", Bar::AtMost(FREED_S)),
    ];
    Ok(Section { device, tables: vec![table], checks })
}
