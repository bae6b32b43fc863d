//! A walk around the scene, and its stills beside direct drawing.

use std::time::Duration;

use anyhow::Context as _;
use cluster::PolicyChoice;
use report::{Bar, Cell, Check, Table};
use serde_json::Value;

use super::page::{Page, longest_gap_s};
use super::stand::{Ground, Stand};
use crate::process::http_page;
use crate::section::Section;
use crate::statistics::median;

const SIZE_PX: [u32; 2] = [640, 360];
/// Stills of the walk.
const STILLS: usize = 24;
const WALK_S: f64 = 24.0;
/// Drags of the walk: each stays within the canvas.
const PARTS: usize = 3;
/// The rest after which view cells have followed: nodes report viewers once a second.
const REST: Duration = Duration::from_secs(2);
const WITHIN: Duration = Duration::from_secs(30);

/// # Errors
/// A process does not start, or no picture comes.
pub(super) async fn measure(ground: &Ground) -> anyhow::Result<Section> {
    let stand = Stand::start(ground, PolicyChoice::Pipeline).await?;
    let page = stand.page(SIZE_PX).await?;
    page.drag(2.0).await?;
    page.wait_for_finished(WITHIN).await?;
    let index = page.picture_count().await?;
    let since_ms = page.now_ms().await?;
    for _ in 0..PARTS {
        page.turn(1.0 / PARTS as f64, WALK_S / PARTS as f64).await?;
    }
    let until_ms = page.now_ms().await?;
    let pictures = page.pictures_since(index).await?;
    let per_s = pictures.len() as f64 * 1000.0 / (until_ms - since_ms);
    let gap_s = longest_gap_s(&pictures, since_ms, until_ms);
    let [foreground_db, psnr_db] = stills(&stand, &page).await?;
    let [least_foreground_db, least_db] =
        [&foreground_db, &psnr_db].map(|psnr_db| psnr_db.iter().copied().fold(f64::INFINITY, f64::min));
    let mut table = Table::new(
        "A walk of 360° in 24 s, and 24 stills beside direct drawing",
        &[
            ("pictures a second", ""),
            ("longest gap", "s"),
            ("foreground PSNR of stills, least", "dB"),
            ("foreground, median", "dB"),
            ("PSNR of stills, least", "dB"),
            ("median", "dB"),
        ],
    );
    let foreground = [least_foreground_db, median(foreground_db)];
    table.push([per_s, gap_s].into_iter().chain(foreground).chain([least_db, median(psnr_db)]).map(Cell::from))?;
    let mut stills_check = Check::new("walk: least PSNR of 24 stills", least_db, "dB", Bar::AtLeast(30.0));
    stills_check.foreground = Some(least_foreground_db).filter(|db| db.is_finite());
    let checks = vec![
        Check::new("walk: pictures a second", per_s, "", Bar::AtLeast(10.0)),
        Check::new("walk: longest gap", gap_s, "s", Bar::AtMost(0.7)),
        stills_check,
    ];
    Ok(Section { device: stand.processes.device.clone(), tables: vec![table], checks })
}

/// The PSNR of the foreground and of the whole picture of the stills of a visitor who rests for two seconds after every 15°.
async fn stills(stand: &Stand, page: &Page) -> anyhow::Result<[Vec<f64>; 2]> {
    let mut psnr_db = [Vec::new(), Vec::new()];
    for _ in 0..STILLS {
        page.turn(1.0 / STILLS as f64, 0.3).await?;
        tokio::time::sleep(REST).await;
        page.wait_for_finished(WITHIN).await?;
        let query = "const { eye, target, fov_y_deg } = window.myriorama.camera.toCamera(window.myriorama.state());
            return `eye=${eye}&target=${target}&fov=${fov_y_deg}`";
        let query: String = page.browser.run(query, Vec::new()).await?;
        let [width, height] = SIZE_PX;
        let body = http_page(&format!("{}api/v1/compare.json?{query}&size={width}x{height}", stand.url)).await?;
        let compared: Value = serde_json::from_str(&body).with_context(|| format!("not compared: {body}"))?;
        for (name, psnr_db) in ["foreground_psnr_db", "psnr_db"].into_iter().zip(&mut psnr_db) {
            psnr_db.push(compared[name].as_f64().context("a PSNR")?);
        }
    }
    Ok(psnr_db)
}
