//! The first view of a size that no client has requested, on a warm workload.

use std::time::Instant;

use app_core::delivery::{open, receive, request};
use client::Client;
use cluster::PolicyChoice;
use glam::UVec2;
use report::{Bar, Cell, Check, Table};

use super::guests::SMALL_PX;
use super::up::{Up, policies};
use super::viewer::path;
use crate::section::Section;
use crate::statistics::median;

/// The most that the first view of a new size waits longer than that of a known one.
const LATER_S: f64 = 0.3;
/// Columns and rows by which each new size is larger than the one before.
const STEP_PX: UVec2 = UVec2::new(32, 18);

/// Times the first view of a session, of a known size and of a new one in turn.
///
/// # Errors
/// The cluster does not start, or a session is refused.
pub(super) async fn measure(cluster: &[String], repeats: usize) -> anyhow::Result<Section> {
    let up = Up::start(cluster).await?;
    let (mut known_s, mut new_s) = (Vec::new(), Vec::new());
    let (_, policy) = first_view(&up, SMALL_PX).await?;
    for repeat in 1..=repeats as u32 {
        known_s.push(first_view(&up, SMALL_PX).await?.0);
        new_s.push(first_view(&up, SMALL_PX + STEP_PX * repeat).await?.0);
    }
    let columns = [("size", ""), ("policy", ""), ("median", "s"), ("longest", "s")];
    let mut table = Table::new("The first view of a session", &columns);
    for (name, times_s) in [("known", &known_s), ("new", &new_s)] {
        let numbers = [median(times_s.clone()), times_s.iter().copied().fold(0.0, f64::max)];
        table.push([Cell::from(name), policy.clone().into()].into_iter().chain(numbers.map(Cell::from)))?;
    }
    let later_s = median(known_s.iter().zip(&new_s).map(|(known_s, new_s)| new_s - known_s).collect());
    let name = "first view of a new size, later than of a known one";
    let checks = vec![Check::new(name, later_s, "s", Bar::AtMost(LATER_S))];
    Ok(Section { device: up.device.clone(), tables: vec![table], checks })
}

/// Seconds from the opening of a session to its one view, and the policy in force.
async fn first_view(up: &Up, size_px: UVec2) -> anyhow::Result<(f64, String)> {
    let offer = up.offer()?;
    let client = Client::connect(&up.coordinator).await?;
    let views = path(offer, 1, size_px)?;
    let start = Instant::now();
    let request = request(offer.settings.clone(), PolicyChoice::Pipeline, &views)?;
    let session = open(&client, request).await?;
    receive(&session, &views, async |_| Ok(())).await?;
    let seconds = start.elapsed().as_secs_f64();
    Ok((seconds, policies(&up.coordinator).await?))
}
