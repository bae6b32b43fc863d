//! Pictures of a drag: how many a second, how old, how large, and what the gateway takes of a processor for each.

use std::time::Duration;

use cluster::PolicyChoice;
use report::{Bar, Check};

use super::page::{Page, Picture};
use super::stand::{Ground, Stand};
use crate::memory::processor_s;
use crate::section::Section;
use crate::statistics::{median, median_of, quantile};
use crate::study::{Column, table};

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
    let rows = [
        ("pipeline", SMALL, small),
        ("pipeline", LARGE, large),
        ("auto", SMALL, auto_small),
        ("auto", LARGE, auto_large),
    ]
    .map(|(policy, size_px, drags)| DragsRow { policy, size_px, drags });
    let off_ms = rows.iter().map(|row| row.drags.parts_off_ms).fold(0.0, f64::max);
    checks.push(Check::new("an age beside the sum of its parts", off_ms, "ms", Bar::AtMost(2.0)));
    Ok(Section { device, tables: vec![table("Dragging", &COLUMNS, &rows)?], checks })
}

/// The drags at a size under a policy.
struct DragsRow {
    policy: &'static str,
    size_px: [u32; 2],
    drags: Drags,
}

const COLUMNS: [Column<DragsRow>; 9] = [
    Column::new("policy", |row| row.policy.into()),
    Column::new("canvas", |row| format!("{}×{}", row.size_px[0], row.size_px[1]).into()),
    Column::new("pictures a second", |row| row.drags.per_s.into()),
    Column::with_unit("age, median", "ms", |row| row.drags.age_ms[0].into()),
    Column::with_unit("age, 95 %", "ms", |row| row.drags.age_ms[1].into()),
    Column::with_unit("first move", "ms", |row| row.drags.first_move_ms.into()),
    Column::with_unit("picture", "kB", |row| (row.drags.bytes / 1000.0).into()),
    Column::with_unit("gateway's processor", "ms", |row| row.drags.gateway_ms.into()),
    Column::with_unit("network and gateway", "ms", |row| row.drags.detour_ms.into()),
];

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
    Ok(Drags {
        per_s: median_of(&all, |drags| drags.per_s),
        age_ms: [0, 1].map(|place| median_of(&all, |drags| drags.age_ms[place])),
        parts_off_ms: all.iter().map(|drags| drags.parts_off_ms).fold(0.0, f64::max),
        bytes: median_of(&all, |drags| drags.bytes),
        detour_ms: median_of(&all, |drags| drags.detour_ms),
        gateway_ms: median_of(&all, |drags| drags.gateway_ms),
        first_move_ms: median(moves),
        pose_bytes: page.browser.value("window.longestPose").await?,
    })
}

async fn one_drag(stand: &Stand, page: &Page) -> anyhow::Result<Drags> {
    let before_s = processor_s(stand.gateway.id()).unwrap_or(f64::NAN);
    let start_ms = page.now_ms().await?;
    let pictures = page.drag(DRAG_S).await?;
    let used_s = processor_s(stand.gateway.id()).unwrap_or(f64::NAN) - before_s;
    let found: Vec<&Picture> = pictures.iter().filter(|picture| picture.painted_ms > start_ms + FOUND_MS).collect();
    let ages_ms: Vec<f64> = found.iter().map(|picture| picture.age_ms).collect();
    let parts_off_ms =
        found.iter().map(|picture| (picture.age_ms - picture.parts_ms).abs().max(-picture.least_part_ms));
    Ok(Drags {
        per_s: found.len() as f64 / (DRAG_S - FOUND_MS / 1000.0),
        age_ms: [0.5, 0.95].map(|share| quantile(ages_ms.clone(), share)),
        parts_off_ms: parts_off_ms.fold(0.0, f64::max),
        bytes: median_of(&found, |picture| picture.bytes),
        detour_ms: median_of(&found, |picture| picture.detour_ms),
        gateway_ms: used_s * 1000.0 / pictures.len() as f64,
        first_move_ms: f64::NAN,
        pose_bytes: f64::NAN,
    })
}
