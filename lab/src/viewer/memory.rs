//! Memory of the page and of the gateway while a visitor drags and rests.

use std::time::{Duration, Instant};

use cluster::PolicyChoice;
use report::{Bar, Cell, Check, Table};

use super::stand::{Ground, Stand};
use crate::memory::memory_mib;
use crate::section::Section;

const SIZE_PX: [u32; 2] = [640, 360];
const DRAG_S: f64 = 8.0;
const WITHIN: Duration = Duration::from_secs(30);
/// The first part of the time, in which caches fill.
const WARM: f64 = 0.2;
const MIB: f64 = (1 << 20) as f64;

/// # Errors
/// A process does not start, or no picture comes.
pub(super) async fn measure(ground: &Ground) -> anyhow::Result<Section> {
    let stand = Stand::start(ground, PolicyChoice::Pipeline).await?;
    let page = stand.page(SIZE_PX).await?;
    let start = Instant::now();
    let mut readings = Vec::new();
    while start.elapsed().as_secs_f64() < ground.memory_s {
        page.drag(DRAG_S).await?;
        page.wait_for_finished(WITHIN).await?;
        let heap_mib = page.browser.heap_bytes().await? / MIB;
        let gateway_mib = memory_mib(&stand.gateway.id().to_string()).unwrap_or(f64::NAN);
        readings.push([heap_mib, gateway_mib]);
    }
    let warm = &readings[(readings.len() as f64 * WARM) as usize..];
    let mut table = Table::new(
        format!("Memory over {:.0} s of drags and rests", ground.memory_s),
        &[("of", ""), ("first", "MiB"), ("last", "MiB"), ("most", "MiB")],
    );
    let mut checks = Vec::new();
    for (at, name) in ["the page's scripts", "the gateway"].into_iter().enumerate() {
        let [first, last] = [warm.first(), warm.last()].map(|reading| reading.map_or(f64::NAN, |reading| reading[at]));
        let most = warm.iter().map(|reading| reading[at]).fold(0.0, f64::max);
        table.push([Cell::from(name), first.into(), last.into(), most.into()])?;
        checks.push(Check::new(format!("memory of {name}: growth"), last - first, "MiB", Bar::AtMost(32.0)));
    }
    Ok(Section { device: stand.processes.device.clone(), tables: vec![table], checks })
}
