//! Pictures of a drag: how many a second, how old, how large, and what the gateway takes of a processor for each.

use std::time::Duration;

use cluster::PolicyChoice;
use report::{Bar, Cell, Check, Table};

use super::page::{Page, Picture};
use super::stand::{Ground, Stand};
use crate::memory::processor_s;
use crate::section::Section;
use crate::statistics::{median, quantile};

/// Seconds of a drag.
const DRAG_S: f64 = 5.0;
/// The first part of a drag, in which sizes are found.
const FOUND_MS: f64 = 1000.0;
const STILL: Duration = Duration::from_secs(20);
/// The rest before a first move, and the length of that move.
const REST: Duration = Duration::from_millis(600);
const FIRST_MOVE_S: f64 = 0.05;
const SMALL: [u32; 2] = [320, 180];
const LARGE: [u32; 2] = [640, 360];

/// The figures of the drags at a size; each is a median of the repeats.
struct Drags {
    per_s: f64,
    age_ms: [f64; 2],
    /// The greatest difference between an age and the sum of its parts, or the greatest time below 0 of a part.
    parts_off_ms: f64,
    bytes: f64,
    detour_ms: f64,
    gateway_ms: f64,
    first_move_ms: f64,
    pose_bytes: f64,
}

/// # Errors
/// A process does not start, or the page shows nothing.
pub(super) async fn measure(ground: &Ground) -> anyhow::Result<Section> {
    let stand = Stand::start(ground, PolicyChoice::Pipeline).await?;
    let page_bytes = page_bytes(&stand).await?;
    let [small, large] = [drags(ground, &stand, SMALL).await?, drags(ground, &stand, LARGE).await?];
    let device = stand.processes.device.clone();
    drop(stand);
    let stand = Stand::start(ground, PolicyChoice::Auto).await?;
    let [auto_small, auto_large] = [drags(ground, &stand, SMALL).await?, drags(ground, &stand, LARGE).await?];
    let rows = [
        ("pipeline", SMALL, &small),
        ("pipeline", LARGE, &large),
        ("auto", SMALL, &auto_small),
        ("auto", LARGE, &auto_large),
    ];
    let mut checks = vec![
        Check::new("pictures a second at 320×180", small.per_s, "", Bar::AtLeast(20.0)),
        Check::new("pictures a second at 640×360", large.per_s, "", Bar::AtLeast(9.0)),
        Check::new("pictures a second at 320×180, auto", auto_small.per_s, "", Bar::AtLeast(20.0)),
        Check::new("pictures a second at 640×360, auto", auto_large.per_s, "", Bar::AtLeast(9.0)),
        Check::new("input to pixel at 320×180, median", small.age_ms[0], "ms", Bar::AtMost(100.0)),
        Check::new("input to pixel at 320×180, 95 %", small.age_ms[1], "ms", Bar::AtMost(200.0)),
        Check::new("first move from rest", small.first_move_ms, "ms", Bar::AtMost(80.0)),
        Check::new("a picture of 320×180", small.bytes / 1000.0, "kB", Bar::AtMost(14.0)),
        Check::new("a pose", small.pose_bytes, "B", Bar::AtMost(300.0)),
        Check::new("the page", page_bytes / 1000.0, "kB", Bar::AtMost(120.0)),
        Check::new("a processor's time of the gateway for a picture", small.gateway_ms, "ms", Bar::AtMost(0.6)),
        Check::new("age over that of a client of gRPC", small.detour_ms, "ms", Bar::AtMost(8.0)),
    ];
    let off_ms = rows.iter().map(|(.., drags)| drags.parts_off_ms).fold(0.0, f64::max);
    checks.push(Check::new("an age beside the sum of its parts", off_ms, "ms", Bar::AtMost(2.0)));
    Ok(Section { device, tables: vec![table(&rows)?], checks })
}

fn table(rows: &[(&str, [u32; 2], &Drags)]) -> anyhow::Result<Table> {
    let columns = [
        ("policy", ""),
        ("canvas", ""),
        ("pictures a second", ""),
        ("age, median", "ms"),
        ("age, 95 %", "ms"),
        ("first move", "ms"),
        ("picture", "kB"),
        ("gateway's processor", "ms"),
        ("network and gateway", "ms"),
    ];
    let mut table = Table::new("Dragging", &columns);
    for (policy, [width, height], drags) in rows {
        let [median_ms, late_ms] = drags.age_ms;
        let figures = [
            drags.per_s,
            median_ms,
            late_ms,
            drags.first_move_ms,
            drags.bytes / 1000.0,
            drags.gateway_ms,
            drags.detour_ms,
        ];
        let head = [Cell::from(*policy), format!("{width}×{height}").into()];
        table.push(head.into_iter().chain(figures.map(Cell::from)))?;
    }
    Ok(table)
}

/// Bytes of all files that the page loads.
async fn page_bytes(stand: &Stand) -> anyhow::Result<f64> {
    let page = stand.page(SMALL).await?;
    let sum = "performance.getEntries().reduce((sum, entry) => sum + (entry.transferSize || 0), 0)";
    Ok(page.browser.value(sum).await?)
}

async fn drags(ground: &Ground, stand: &Stand, size_px: [u32; 2]) -> anyhow::Result<Drags> {
    let page = stand.page(size_px).await?;
    page.watch().await?;
    // Once for the shaders of all sizes.
    page.drag(DRAG_S).await?;
    let mut all = Vec::new();
    let mut moves = Vec::new();
    for _ in 0..ground.repeats {
        page.wait_for_finished(STILL).await?;
        tokio::time::sleep(REST).await;
        let before = page.picture_count().await?;
        page.drag(FIRST_MOVE_S).await?;
        page.wait_for_finished(STILL).await?;
        let first = page.moving_since(before).await?.into_iter().next();
        moves.push(first.map_or(f64::INFINITY, |picture| picture.age_ms));
        all.push(one_drag(stand, &page).await?);
    }
    let of = |figure: fn(&Drags) -> f64| median(all.iter().map(figure).collect());
    Ok(Drags {
        per_s: of(|drags| drags.per_s),
        age_ms: [of(|drags| drags.age_ms[0]), of(|drags| drags.age_ms[1])],
        parts_off_ms: all.iter().map(|drags| drags.parts_off_ms).fold(0.0, f64::max),
        bytes: of(|drags| drags.bytes),
        detour_ms: of(|drags| drags.detour_ms),
        gateway_ms: of(|drags| drags.gateway_ms),
        first_move_ms: median(moves),
        pose_bytes: page.browser.value("window.longestPose").await?,
    })
}

async fn one_drag(stand: &Stand, page: &Page) -> anyhow::Result<Drags> {
    let used = || processor_s(stand.gateway.id()).unwrap_or(f64::NAN);
    let before_s = used();
    let start_ms = page.now_ms().await?;
    let pictures = page.drag(DRAG_S).await?;
    let used_s = used() - before_s;
    let found: Vec<&Picture> = pictures.iter().filter(|picture| picture.painted_ms > start_ms + FOUND_MS).collect();
    let of = |figure: fn(&&Picture) -> f64| found.iter().map(figure).collect::<Vec<_>>();
    Ok(Drags {
        per_s: found.len() as f64 / (DRAG_S - FOUND_MS / 1000.0),
        age_ms: [0.5, 0.95].map(|share| quantile(of(|picture| picture.age_ms), share)),
        parts_off_ms: of(|picture| (picture.age_ms - picture.parts_ms).abs().max(-picture.least_part_ms))
            .into_iter()
            .fold(0.0, f64::max),
        bytes: median(of(|picture| picture.bytes)),
        detour_ms: median(of(|picture| picture.detour_ms)),
        gateway_ms: used_s * 1000.0 / pictures.len() as f64,
        first_move_ms: f64::NAN,
        pose_bytes: f64::NAN,
    })
}
