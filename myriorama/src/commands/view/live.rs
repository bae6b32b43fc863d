//! A live view: a camera that moves along the views.

use std::time::Duration;

use anyhow::Context as _;
use app_core::exit::Outcome;
use app_core::live::{self, Drive};
use client::Session;
use depth_image::PinholeCamera;

use super::args::ViewArgs;

/// Moves along `path`, then prints and writes where the time of frames went.
pub(super) async fn follow(args: &ViewArgs, session: &Session, path: Vec<PinholeCamera>) -> anyhow::Result<Outcome> {
    let drive = Drive {
        path,
        rate_hz: args.rate,
        lasting: Duration::from_secs_f64(args.seconds),
        set_step_s: args.frame_step,
        set_count: args.frames,
    };
    let record = live::drive(session, &drive).await?;
    let file = args.out.join("live.csv");
    std::fs::write(&file, record.frames()?.to_csv()?).with_context(|| format!("cannot write {}", file.display()))?;
    let latencies = live::latencies("From pose to picture", record.shown.iter())?;
    println!("{}\n\n{}", latencies.to_text(), record.summary());
    if let Some(error) = record.error {
        return Err(error.into());
    }
    let gap_s = record.longest_gap_s().map_or(f64::INFINITY, |(gap_s, _)| gap_s);
    Ok(Outcome::of(args.longest_gap.is_none_or(|longest| gap_s <= longest)))
}
