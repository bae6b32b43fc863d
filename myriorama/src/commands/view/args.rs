//! Arguments of `view`, and the cameras that they place.

use std::path::PathBuf;

use anyhow::Context as _;
use app_core::addresses::CoordinatorArgs;
use app_core::camera_file::{self, Placement};
use app_core::exit::BadInput;
use app_core::quality::QualityArgs;
use app_core::sizes::{SizePx, grid, within};
use clap::Args;
use cluster::{OfferStatus, PolicyChoice};
use codec::FrameCodec;
use depth_image::{Antialias, PinholeCamera, ViewCell, ViewPlanes};
use glam::{DVec3, Vec3};
use planner::Budget;
use reconstruction::ReconstructionMethod;
use render::Lighting;

use crate::tone::ToneArgs;

/// Asks for views and writes them to --out. Colour is view_0000.png. With --depth, view_0000.depth.png has 16-bit
/// inverse planar depth: value / 65535 × inverse_depth_max_per_m of the frame in cameras.json, 0 for background. With
/// --provenance, view_0000.provenance.png has a colour for each sample camera, white for blended and red for filled
/// pixels. cameras.json has the cameras of all written views in the transforms.json convention, in the scene file's
/// coordinates. It is written every few seconds. After ctrl-c or SIGTERM, pictures that are being written are finished,
/// and the exit status is 130; a second ctrl-c ends at once. --resume then requests the remaining views.
#[derive(Debug, Args)]
pub struct ViewArgs {
    #[command(flatten)]
    pub(super) coordinator: CoordinatorArgs,
    /// The scene, by its name or hash at the coordinator [default: the first on offer]
    #[arg(long, value_name = "NAME")]
    pub(super) scene: Option<String>,
    #[command(flatten)]
    pub(super) viewpoints: Viewpoints,
    /// Samples near the views, in as many view cells as they need, in place of the coordinator's sample cameras
    #[arg(long)]
    pub(super) cells: bool,
    /// Size of the views, unless --cameras gives it
    #[arg(long, default_value = "200x150", value_name = "WxH")]
    pub(super) size: SizePx,
    /// The folder of the pictures
    #[arg(long, default_value = "out/view", value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Requests only the views that --out does not have yet, as its cameras.json says. Settings must be the same
    #[arg(long, conflicts_with = "live")]
    pub(super) resume: bool,
    /// Samples a pixel, whose mean in linear light is its colour: 1, 2, 4, 8 or 16. Depth and provenance are the centre's
    #[arg(long, default_value = "4", value_name = "N")]
    pub(super) antialias: Antialias,
    #[command(flatten)]
    pub(super) tone: ToneArgs,
    /// Writes the depth of every view as well
    #[arg(long)]
    pub(super) depth: bool,
    /// Writes the provenance of every pixel as well
    #[arg(long)]
    pub(super) provenance: bool,
    /// How views are made [default: the coordinator's, or else shared light where light is traced and direct drawing in plain light;
    /// from samples alone in plain light with --policy pipeline or time-share]
    #[arg(long, value_name = "NAME")]
    method: Option<ReconstructionMethod>,
    #[command(flatten)]
    quality: QualityArgs,
    /// How surfaces are lit, as in "soft 16, occlusion 16" (see `myriorama up --help`) [default: the coordinator's]
    #[arg(long, value_name = "TERMS")]
    pub(super) lighting: Option<Lighting>,
    /// Draws every view directly as well, and prints the PSNR, SSIM and FLIP of the views against it, over the
    /// pixels that show a surface and over the whole picture; also in comparison.csv
    #[arg(long)]
    pub(super) compare: bool,
    /// How the directly drawn pictures of --compare are lit [default: as the views]
    #[arg(long, value_name = "TERMS", requires = "compare")]
    pub(super) compare_lighting: Option<Lighting>,
    /// The codec of frames: lz4 or png (lossless), or jpeg:QUALITY
    #[arg(long, default_value = "lz4", value_name = "NAME")]
    pub(super) codec: FrameCodec,
    /// The policy: pipeline, direct, time-share, or auto (the fastest by prediction)
    #[arg(long, default_value = "auto", value_name = "NAME")]
    pub(super) policy: PolicyChoice,
    /// The most error, as in "flip 0.02" or "psnr 34" (see `myriorama plan --help`): the cluster chooses what is sampled, and how views
    /// are made. Pictures wait for the choice, at most ten minutes. Where nothing keeps the budget, they are written all the same, and the
    /// exit status is 3. [default: the coordinator's, for which nothing waits]
    #[arg(long, value_name = "BUDGET", conflicts_with_all = ["method", "quality", "policy"])]
    pub(super) budget: Option<Budget>,
    /// Moments of an animated scene; all views are made of each moment
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) frames: u32,
    /// Seconds between moments
    #[arg(long, default_value_t = 1.0 / 30.0, value_name = "S")]
    pub(super) frame_step: f64,
    /// Moves along the views at --rate for --seconds, and prints the time of frames by stage. Every frame is in
    /// live.csv in --out; no pictures are written
    #[arg(long, conflicts_with_all = ["compare", "depth", "provenance"])]
    pub(super) live: bool,
    /// With --live: poses a second
    #[arg(long, default_value_t = 10.0, value_name = "HZ", value_parser = within(0.01..=1000.0))]
    pub(super) rate: f64,
    /// With --live: the time to move
    #[arg(long, default_value_t = 10.0, value_name = "S", value_parser = within(0.1..=86_400.0))]
    pub(super) seconds: f64,
}

impl ViewArgs {
    /// The method that the user names.
    pub(super) fn method(&self) -> Option<ReconstructionMethod> {
        self.method.or(self.quality.method())
    }

    /// The planes of the views, without their tone, which may be the plan's.
    pub(super) fn planes(&self) -> ViewPlanes {
        ViewPlanes {
            antialias: self.antialias,
            inverse_depth: self.depth,
            provenance: self.provenance,
            ..ViewPlanes::COLOR
        }
    }
}

/// One way to place the views; without any, an orbit of 24.
#[derive(Debug, Args)]
#[group(multiple = false)]
pub(super) struct Viewpoints {
    /// N views on an ellipse between the sample cameras
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) orbit: Option<u32>,
    /// Columns × rows of views on the rectangle of the sample cameras
    #[arg(long, value_name = "CxR", value_parser = grid)]
    pub(super) grid: Option<[u32; 2]>,
    /// N views spread evenly on the rectangle of the sample cameras
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) views: Option<u32>,
    /// N views on a circle around the scene, at the height of the sample cameras' centre; implies --cells
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(super) around: Option<u32>,
    /// One view: eye, target and full vertical field of view in degrees, in the scene file's coordinates
    #[arg(long, value_name = "X,Y,Z:X,Y,Z[:FOV]", allow_hyphen_values = true)]
    pub(super) camera: Option<String>,
    /// Views from a transforms.json, in the scene file's coordinates
    #[arg(long, value_name = "FILE")]
    pub(super) cameras: Option<PathBuf>,
}

impl Viewpoints {
    /// The cameras of the views.
    ///
    /// # Errors
    /// A file or a camera cannot be used, or the coordinator has no sample cameras.
    pub(super) fn cameras(&self, offer: &OfferStatus, size: SizePx) -> anyhow::Result<Vec<PinholeCamera>> {
        let near_m = offer.volume.near_m();
        let placement = Placement { source_space: offer.source_space, near_m, size_px: size.0 };
        if let Some(path) = &self.cameras {
            return Ok(camera_file::read(path, placement)?);
        }
        if let Some(text) = &self.camera {
            return Ok(vec![one_camera(text, placement, size)?]);
        }
        let samples: Vec<_> = offer.sample_cameras.iter().map(|camera| *camera.reference()).collect();
        let cell = ViewCell::between(&samples).context("the coordinator has no sample cameras: give --cameras")?;
        Ok(match (self.grid, self.views, self.around) {
            (Some([columns, rows]), ..) => cell.grid(columns, rows, size.0),
            (_, Some(count), _) => cell.spread(count as usize, size.0),
            (.., Some(count)) => cell.around(offer.volume.center(), count as usize, size.0),
            _ => cell.orbit(self.orbit.unwrap_or(24) as usize, size.0),
        })
    }
}

fn one_camera(text: &str, placement: Placement, size: SizePx) -> anyhow::Result<PinholeCamera> {
    let bad =
        || BadInput(format!("--camera {text:?}: expected EYE:TARGET or EYE:TARGET:DEGREES, as in 0,1,3:0,0.5,0:45"));
    let parts = text.split(':').map(|part| {
        part.split(',').map(|v| v.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect::<Option<Vec<_>>>()
    });
    let parts = parts.collect::<Option<Vec<_>>>().ok_or_else(bad)?;
    let parts: Vec<&[f64]> = parts.iter().map(Vec::as_slice).collect();
    let (eye, target, fov_deg) = match parts[..] {
        [&[x, y, z], &[u, v, w]] => ([x, y, z], [u, v, w], 45.0),
        [&[x, y, z], &[u, v, w], &[fov]] if (0.1..=170.0).contains(&fov) => ([x, y, z], [u, v, w], fov),
        _ => return Err(bad().into()),
    };
    let [eye, target] = [eye, target].map(|p| placement.source_space.world_from_source(DVec3::from_array(p)));
    let camera = PinholeCamera::looking_at(eye, target, Vec3::Y, (fov_deg as f32).to_radians(), size.0);
    Ok(PinholeCamera { near_m: placement.near_m, ..camera })
}
