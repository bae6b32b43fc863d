//! `myriorama view`: a thin client that writes what it receives.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use app_core::cameras::{self, NamedCamera, Placement};
use app_core::delivery::{Wishes, open, receive, viewpoints};
use app_core::exit::{BadInput, Outcome};
use app_core::live::{self, Drive};
use app_core::process::runtime;
use app_core::setup::NEAR_OF_DIAGONAL;
use app_core::sizes::{GridSize, SizePx};
use app_core::{pictures, provenance};
use clap::Args;
use client::{Client, Frame, Session};
use cluster::{OfferStatus, PolicyChoice, Timeline};
use codec::FrameCodec;
use depth_image::{Camera, PinholeCamera, ViewCell, ViewPlanes};
use indicatif::ProgressBar;
use reconstruction::ReconstructionMethod;
use render::Lighting;
use serde_json::{Map, json};

use crate::comparison;

/// Files in --out: view_0000.png (colour); with --depth view_0000.depth.png (16-bit inverse planar depth:
/// value / 65535 × inverse_depth_max_per_m of the frame in cameras.json, 0 for background); with --provenance
/// view_0000.provenance.png (false colours: a colour for each sample camera, white blended, red filled); and
/// cameras.json, in the transforms.json convention, in the scene file's own coordinates.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// The coordinator
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:7420", env = "MYRIORAMA_COORDINATOR")]
    coordinator: String,
    #[command(flatten)]
    which: Which,
    /// Sample near the views, in as many view cells as they need, in place of the coordinator's sample cameras
    #[arg(long)]
    cells: bool,
    /// Size of the views, unless --cameras says
    #[arg(long, default_value = "200x150", value_name = "WxH")]
    size: SizePx,
    /// Where the pictures go
    #[arg(long, default_value = "out/view", value_name = "DIR")]
    out: PathBuf,
    /// Depth of every view, too
    #[arg(long)]
    depth: bool,
    /// Where every pixel comes from, too
    #[arg(long)]
    provenance: bool,
    /// How views are reconstructed [default: the coordinator's]
    #[arg(long, value_name = "NAME")]
    method: Option<ReconstructionMethod>,
    /// How surfaces are lit, as in "soft 16, occlusion 16" (see `myriorama up --help`) [default: the coordinator's]
    #[arg(long, value_name = "TERMS")]
    lighting: Option<Lighting>,
    /// Draw every view directly, too, and say how far those in --out are from it: PSNR, SSIM and FLIP, also in
    /// comparison.csv
    #[arg(long)]
    compare: bool,
    /// With --compare: exit status 1 where a view's PSNR is below
    #[arg(long, value_name = "DB", requires = "compare")]
    least_psnr: Option<f64>,
    /// With --frames: begin with one ray a light and pixel and double them from frame to frame, so that the first
    /// picture is there at once
    #[arg(long)]
    refine: bool,
    /// How frames travel: lz4 (without loss) or jpeg:QUALITY
    #[arg(long, default_value = "lz4", value_name = "NAME")]
    codec: FrameCodec,
    /// auto (whatever is predicted to be fastest), pipeline, direct or time-share
    #[arg(long, default_value = "auto", value_name = "NAME")]
    policy: PolicyChoice,
    /// Cut every sample image into so many tiles, to share them among samplers [default: as predicted to be fastest]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16))]
    tiles: Option<u32>,
    /// Moments of an animated scene; every view is made of each
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Seconds between moments
    #[arg(long, default_value_t = 1.0 / 30.0, value_name = "S")]
    frame_step: f64,
    /// Move along the views as a viewer does, at --rate for --seconds, and print where frames' time went; every frame
    /// is in live.csv in --out, none is a picture
    #[arg(long, conflicts_with_all = ["compare", "depth", "provenance"])]
    live: bool,
    /// With --live: poses a second
    #[arg(long, default_value_t = 10.0, value_name = "HZ", value_parser = rate)]
    rate: f64,
    /// With --live: for how long
    #[arg(long, default_value_t = 10.0, value_name = "S", value_parser = duration)]
    seconds: f64,
    /// With --live: exit status 1 where no new frame came for longer
    #[arg(long, value_name = "S", requires = "live")]
    longest_gap: Option<f64>,
}

fn rate(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|hz| (0.01..=1000.0).contains(hz)).ok_or_else(|| "expected 0.01 to 1000".to_owned())
}

fn duration(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|s| (0.1..=86_400.0).contains(s)).ok_or_else(|| "expected 0.1 to 86400".to_owned())
}

/// Which views: one of these; an orbit of 24 without any.
#[derive(Debug, Args)]
#[group(multiple = false)]
struct Which {
    /// N views on an ellipse between the sample cameras
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    orbit: Option<u32>,
    /// Columns × rows of views over the rectangle of the sample cameras
    #[arg(long, value_name = "CxR")]
    grid: Option<GridSize>,
    /// N views spread evenly over the rectangle of the sample cameras
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    views: Option<u32>,
    /// N views on a circle around the scene, at the height of the sample cameras' middle; as with --cells
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    around: Option<u32>,
    /// One view: eye, target and full vertical field of view in degrees, in the scene file's coordinates
    #[arg(long, value_name = "X,Y,Z:X,Y,Z[:FOV]", allow_hyphen_values = true)]
    camera: Option<String>,
    /// Views from a transforms.json, in the scene file's coordinates
    #[arg(long, value_name = "FILE")]
    cameras: Option<PathBuf>,
}

impl Which {
    fn cameras(&self, offer: &OfferStatus, size: SizePx) -> anyhow::Result<Vec<PinholeCamera>> {
        let near_m = (offer.volume.size().length() * NEAR_OF_DIAGONAL).max(1e-6);
        let placement = Placement { origin_in_source: offer.origin_in_source, near_m };
        if let Some(path) = &self.cameras {
            return Ok(cameras::read(path, placement)?);
        }
        if let Some(text) = &self.camera {
            return Ok(vec![one_camera(text, placement, size)?]);
        }
        let samples: Vec<_> = offer.sample_cameras.iter().map(|Camera::Pinhole(camera)| *camera).collect();
        let cell = ViewCell::between(&samples).context("the coordinator has no sample cameras: give --cameras")?;
        Ok(match (self.grid, self.views, self.around) {
            (Some(grid), ..) => cell.grid(grid.columns, grid.rows, size.0),
            (_, Some(count), _) => cell.spread(count as usize, size.0),
            (.., Some(count)) => cell.around(offer.volume.center(), count as usize, size.0),
            _ => cell.orbit(self.orbit.unwrap_or(24) as usize, size.0),
        })
    }
}

fn one_camera(text: &str, placement: Placement, size: SizePx) -> anyhow::Result<PinholeCamera> {
    let bad =
        || BadInput(format!("--camera {text:?}: expected EYE:TARGET or EYE:TARGET:DEGREES, as in 0,1,3:0,0.5,0:45"));
    let numbers = |part: &str| {
        part.split(',').map(|v| v.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect::<Option<Vec<_>>>()
    };
    let parts = text.split(':').map(numbers).collect::<Option<Vec<_>>>().ok_or_else(bad)?;
    let triple = |part: &[f64]| <[f64; 3]>::try_from(part).ok();
    let (eye, target, fov_deg) = match &parts[..] {
        [eye, target] => (triple(eye), triple(target), 45.0),
        [eye, target, fov] if fov.len() == 1 && (0.1..=170.0).contains(&fov[0]) => {
            (triple(eye), triple(target), fov[0])
        }
        _ => (None, None, 0.0),
    };
    let (Some(eye), Some(target)) = (eye, target) else { return Err(bad().into()) };
    let [eye, target] = [eye, target].map(|p| (glam::DVec3::from_array(p) - placement.origin_in_source).as_vec3());
    let camera = PinholeCamera::looking_at(eye, target, glam::Vec3::Y, (fov_deg as f32).to_radians(), size.0);
    Ok(PinholeCamera { near_m: placement.near_m, ..camera })
}

/// Asks, receives, writes.
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
    let cameras = args.which.cameras(&offer, args.size)?;
    let folder = &args.out;
    std::fs::create_dir_all(folder).with_context(|| format!("cannot write to {}", folder.display()))?;
    let views = if args.live { &cameras[..1] } else { &cameras[..] };
    let session = open(&client, &wishes(&args, &offer, &cameras), views).await?;
    let plan = session.plan();
    println!("plan {}: {}", plan.assignment.plan_epoch, plan.reason);
    if args.live {
        return live(&args, &session, cameras).await;
    }
    let progress = ProgressBar::new(cameras.len() as u64 * u64::from(args.frames));
    let delivered = receive(&session, &cameras, |_| progress.inc(1)).await?;
    progress.finish_and_clear();
    let named = delivered.frames.iter().map(|frame| write_frame(folder, frame)).collect::<anyhow::Result<Vec<_>>>()?;
    let about = Map::from_iter([(
        "depth".to_owned(),
        json!("16-bit: value / 65535 * inverse_depth_max_per_m, per metre; 0 is background"),
    )]);
    cameras::write(&folder.join("cameras.json"), &named, offer.origin_in_source, about)?;
    println!("{} views in {:.3} s, in {}", named.len(), delivered.seconds, folder.display());
    if args.compare {
        drop(session);
        let direct = Wishes { policy: PolicyChoice::Direct, ..wishes(&args, &offer, &cameras) };
        let session = open(&client, &direct, &cameras).await?;
        let truth = receive(&session, &cameras, |_| ()).await?;
        let (table, worst_psnr_db) = comparison::table(&truth.frames, &delivered.frames)?;
        println!("\n{}", table.to_text());
        let path = folder.join("comparison.csv");
        std::fs::write(&path, table.to_csv()?).with_context(|| format!("cannot write {}", path.display()))?;
        return Ok(met(args.least_psnr.is_none_or(|least| worst_psnr_db >= least)));
    }
    Ok(Outcome::Done)
}

async fn live(args: &ViewArgs, session: &Session, path: Vec<PinholeCamera>) -> anyhow::Result<Outcome> {
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
    Ok(met(args.longest_gap.is_none_or(|longest| gap_s <= longest)))
}

fn met(holds: bool) -> Outcome {
    if holds { Outcome::Done } else { Outcome::FellShort }
}

fn wishes(args: &ViewArgs, offer: &OfferStatus, cameras: &[PinholeCamera]) -> Wishes {
    let mut wishes = Wishes::offered(offer);
    wishes.method = args.method.map_or(wishes.method, |method| method.to_string());
    wishes.lighting = args.lighting.map_or(wishes.lighting, |lighting| lighting.to_string());
    let wishes = if args.live { wishes.at_rate(args.rate) } else { wishes };
    Wishes {
        tiles: args.tiles,
        refinement_steps: if args.refine { refinement_steps(&wishes.lighting) } else { 1 },
        codec: args.codec.to_string(),
        policy: args.policy,
        planes: ViewPlanes { inverse_depth: args.depth, provenance: args.provenance },
        timeline: timeline(args.frames, args.frame_step, args.refine),
        viewpoints: if args.cells || args.which.around.is_some() { viewpoints(cameras) } else { Vec::new() },
        ..wishes
    }
}

/// A picture that is refined stands still: what moved meanwhile would have to begin anew.
fn timeline(set_count: u32, step_s: f64, refine: bool) -> Timeline {
    Timeline { start_s: 0.0, step_s: if refine { 0.0 } else { step_s }, set_count }
}

/// Of a lighting that a newer coordinator may have named: one step where it is not known here.
fn refinement_steps(lighting: &str) -> u32 {
    lighting.parse().map_or(1, |lighting: Lighting| lighting.refinement_steps())
}

fn write_frame(folder: &Path, frame: &Frame) -> anyhow::Result<NamedCamera> {
    let stem = format!("view_{:04}", frame.request.frame);
    let file_path = format!("{stem}.png");
    let save = |path: PathBuf, image: image::DynamicImage| {
        image.save(&path).with_context(|| format!("cannot write {}", path.display()))
    };
    let color = pictures::rgb(&frame.view).context("a view is not of its size")?;
    save(folder.join(&file_path), color.into())?;
    let mut more = Map::from_iter([("set_index".to_owned(), json!(frame.request.set_index))]);
    if let Some((image, greatest)) = pictures::inverse_depth_16(&frame.view) {
        let name = format!("{stem}.depth.png");
        save(folder.join(&name), image.into())?;
        more.insert("depth_file_path".to_owned(), json!(name));
        more.insert("inverse_depth_max_per_m".to_owned(), json!(greatest));
    }
    if let Some(provenance) = provenance::false_color(&frame.view) {
        let name = format!("{stem}.provenance.png");
        save(folder.join(&name), provenance.image.into())?;
        more.insert("provenance_file_path".to_owned(), json!(name));
    }
    Ok(NamedCamera { file_path, camera: frame.request.camera, more })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refined_stands_still() {
        assert!(timeline(4, 0.1, false).moves());
        assert!(!timeline(4, 0.1, true).moves() && timeline(4, 0.1, true).set_count == 4);
        assert!(!timeline(1, 0.1, false).moves(), "one set");
    }
}
