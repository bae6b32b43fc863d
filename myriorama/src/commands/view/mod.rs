//! `myriorama view`: a thin client that writes what it receives.

mod args;
mod live;
mod pictures;
mod request;
mod viewpoints;

use std::time::Duration;

use anyhow::Context as _;
use app_core::camera_file;
use app_core::delivery::{Delivered, SessionSettings, open, receive};
use app_core::exit::Outcome;
use app_core::process::runtime;
use client::{Client, Session};
use cluster::{OfferStatus, PolicyChoice};
use depth_image::PinholeCamera;
use indicatif::ProgressBar;
use serde_json::{Map, json};

use self::request::session_settings;
use crate::comparison;

pub use args::ViewArgs;

/// Asks for views, receives them, and writes them.
///
/// # Errors
/// Input that cannot be used, a cluster that cannot be reached, or a folder that cannot be written.
pub fn run(args: ViewArgs) -> anyhow::Result<Outcome> {
    runtime()?.block_on(view(args))
}

async fn view(args: ViewArgs) -> anyhow::Result<Outcome> {
    let client =
        Client::connect(&args.coordinator).await.with_context(|| format!("no coordinator at {}", args.coordinator))?;
    let status = client.wait_for_nodes(1, Duration::from_secs(30)).await?;
    let offer = status.offer.context("the coordinator does not say what it shows")?;
    let cameras = args.viewpoints.cameras(&offer, args.size)?;
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot write to {}", args.out.display()))?;
    let settings = session_settings(&args, &offer, &cameras);
    let views = if args.live { &cameras[..1] } else { &cameras[..] };
    let session = open(&client, &settings, views).await?;
    let plan = session.plan();
    println!("plan {}: {}", plan.assignment.plan_epoch, plan.reason);
    if args.live {
        return live::follow(&args, &session, cameras).await;
    }
    let delivered = write_all(&args, &session, &offer, &cameras).await?;
    if !args.compare {
        return Ok(Outcome::Done);
    }
    drop(session);
    compare(&args, &client, settings, &cameras, &delivered).await
}

/// Receives all views and writes their pictures and cameras.
async fn write_all(
    args: &ViewArgs,
    session: &Session,
    offer: &OfferStatus,
    cameras: &[PinholeCamera],
) -> anyhow::Result<Delivered> {
    let progress = ProgressBar::new(cameras.len() as u64 * u64::from(args.frames));
    let delivered = receive(session, cameras, |_| progress.inc(1)).await?;
    progress.finish_and_clear();
    let write = |frame| pictures::write(&args.out, frame);
    let named = delivered.frames.iter().map(write).collect::<anyhow::Result<Vec<_>>>()?;
    let about = Map::from_iter([(
        "depth".to_owned(),
        json!("16-bit: value / 65535 * inverse_depth_max_per_m, per metre; 0 is background"),
    )]);
    camera_file::write(&args.out.join("cameras.json"), &named, offer.origin_in_source, about)?;
    println!("{} views in {:.3} s, in {}", named.len(), delivered.seconds, args.out.display());
    Ok(delivered)
}

/// Asks for the same views drawn directly, and writes how far the delivered ones are from them.
async fn compare(
    args: &ViewArgs,
    client: &Client,
    settings: SessionSettings,
    cameras: &[PinholeCamera],
    delivered: &Delivered,
) -> anyhow::Result<Outcome> {
    let session = open(client, &SessionSettings { policy: PolicyChoice::Direct, ..settings }, cameras).await?;
    let reference = receive(&session, cameras, |_| ()).await?;
    let (table, worst_psnr_db) = comparison::table(&reference.frames, &delivered.frames)?;
    println!("\n{}", table.to_text());
    let path = args.out.join("comparison.csv");
    std::fs::write(&path, table.to_csv()?).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(Outcome::of(args.least_psnr.is_none_or(|least| worst_psnr_db >= least)))
}
