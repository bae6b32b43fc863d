//! `myriorama view`: a thin client that writes what it receives.

mod args;
mod writer;

use std::time::Duration;

use anyhow::Context as _;
use app_core::delivery::{at_rate, open, receive, request, viewpoints};
use app_core::exit::{BadInput, Outcome};
use app_core::live::Drive;
use app_core::{camera_file, live};
use client::{Client, Frame, Session};
use cluster::{OfferStatus, PolicyChoice, SessionRequest, Timeline};
use depth_image::PinholeCamera;
use indicatif::ProgressBar;
use render::Lighting;
use serde_json::{Map, json};

use crate::comparison;

pub use args::ViewArgs;
use writer::{PictureWriter, file_name};

/// Asks for views, receives them, and writes them.
///
/// # Errors
/// Input that cannot be used, a cluster that cannot be reached, or a folder that cannot be written.
pub async fn run(args: ViewArgs) -> anyhow::Result<Outcome> {
    let client =
        Client::connect(&args.coordinator).await.with_context(|| format!("no coordinator at {}", args.coordinator))?;
    let status = client.wait_for_nodes(1, Duration::from_secs(30)).await?;
    let offer = offered(status.offers, args.scene.as_deref())?;
    let cameras = args.viewpoints.cameras(&offer, args.size)?;
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot write to {}", args.out.display()))?;
    let request = session_request(&args, &offer, &cameras)?;
    let session = open(&client, request.clone()).await?;
    let plan = session.plan();
    println!("plan {}: {}", plan.assignment.plan_epoch, plan.reason);
    if args.live {
        return follow(&args, &session, cameras).await;
    }
    write_all(&args, &session, &offer, &cameras).await?;
    if !args.compare {
        return Ok(Outcome::Done);
    }
    drop(session);
    compare(&args, &client, request, &cameras).await
}

/// The offer of a scene by name or hash; the first where none is named.
fn offered(offers: Vec<OfferStatus>, scene: Option<&str>) -> anyhow::Result<OfferStatus> {
    let names: Vec<String> = offers.iter().map(|offer| offer.name.clone()).collect();
    let is_named =
        |offer: &OfferStatus| scene.is_none_or(|scene| scene == offer.name || scene == offer.scene.hash.as_str());
    let missing = || BadInput(format!("--scene {}: on offer are {}", scene.unwrap_or("?"), names.join(", ")));
    Ok(offers.into_iter().find(is_named).ok_or_else(missing)?)
}

fn session_request(args: &ViewArgs, offer: &OfferStatus, cameras: &[PinholeCamera]) -> anyhow::Result<SessionRequest> {
    let views = if args.live { &cameras[..1] } else { cameras };
    let mut request = request(offer.settings.clone(), views)?;
    request.scene = Some(offer.name.clone());
    request.method = args.method.map_or(request.method, |method| method.to_string());
    request.lighting = args.lighting.map_or(request.lighting, |lighting| lighting.to_string());
    let request = if args.live { at_rate(request, args.rate) } else { request };
    Ok(SessionRequest {
        forced_tile_count: args.tiles,
        refinement_steps: if args.refine { refinement_steps(&request.lighting) } else { 1 },
        codec: args.codec.to_string(),
        policy: args.policy,
        planes: args.planes(),
        timeline: timeline(args.frames, args.frame_step, args.refine),
        viewpoints: if args.cells || args.viewpoints.around.is_some() { viewpoints(cameras) } else { Vec::new() },
        ..request
    })
}

/// A picture that is refined stands still: motion would begin the refinement anew.
fn timeline(set_count: u32, step_s: f64, refine: bool) -> Timeline {
    Timeline { start_s: 0.0, step_s: if refine { 0.0 } else { step_s }, set_count }
}

/// The steps of a lighting; one where a newer coordinator names a lighting that is not known here.
fn refinement_steps(lighting: &str) -> u32 {
    lighting.parse().map_or(1, |lighting: Lighting| lighting.refinement_steps())
}

/// Moves along `path`, then prints and writes where the time of frames went.
async fn follow(args: &ViewArgs, session: &Session, path: Vec<PinholeCamera>) -> anyhow::Result<Outcome> {
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

/// Receives all views, and writes each picture as it comes and the cameras at the end.
async fn write_all(
    args: &ViewArgs,
    session: &Session,
    offer: &OfferStatus,
    cameras: &[PinholeCamera],
) -> anyhow::Result<()> {
    let progress = ProgressBar::new(cameras.len() as u64 * u64::from(args.frames));
    let pixels = cameras.iter().map(PinholeCamera::pixel_count).max().unwrap_or(0);
    let mut writer = PictureWriter::new(&args.out, pixels * args.planes().bytes_per_pixel());
    let received = async |frame| {
        writer.write(frame).await?;
        progress.inc(1);
        Ok(())
    };
    let seconds = receive(session, cameras, received).await?;
    let named = writer.finish().await?;
    progress.finish_and_clear();
    let depth = json!("16-bit: value / 65535 * inverse_depth_max_per_m, per metre; 0 is background");
    let about = Map::from_iter([("depth".to_owned(), depth)]);
    camera_file::write(&args.out.join("cameras.json"), &named, offer.origin_in_source, about)?;
    println!("{} views in {seconds:.3} s, in {}", named.len(), args.out.display());
    Ok(())
}

/// Asks for the same views drawn directly, and writes how far the written ones are from them.
async fn compare(
    args: &ViewArgs,
    client: &Client,
    request: SessionRequest,
    cameras: &[PinholeCamera],
) -> anyhow::Result<Outcome> {
    let session = open(client, SessionRequest { policy: PolicyChoice::Direct, ..request }).await?;
    let mut rows = Vec::new();
    let received = async |frame: Frame| {
        let (number, written) = (frame.request.frame, args.out.join(file_name(frame.request.frame)));
        let row = tokio::task::spawn_blocking(move || comparison::row(&frame.view, &written)).await??;
        rows.push((number as usize, row));
        Ok(())
    };
    receive(&session, cameras, received).await?;
    let (table, worst_psnr_db) = comparison::table(rows)?;
    println!("\n{}", table.to_text());
    let path = args.out.join("comparison.csv");
    std::fs::write(&path, table.to_csv()?).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(Outcome::of(args.least_psnr.is_none_or(|least| worst_psnr_db >= least)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refined_timeline_stands_still() {
        assert!(timeline(4, 0.1, false).moves());
        assert!(!timeline(4, 0.1, true).moves() && timeline(4, 0.1, true).set_count == 4);
        assert!(!timeline(1, 0.1, false).moves(), "one set");
    }
}
