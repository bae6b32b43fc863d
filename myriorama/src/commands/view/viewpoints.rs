//! Cameras of the views.

use std::path::PathBuf;

use anyhow::Context as _;
use app_core::camera_file::{self, Placement};
use app_core::exit::BadInput;
use app_core::setup::NEAR_OF_DIAGONAL;
use app_core::sizes::{GridSize, SizePx};
use clap::Args;
use cluster::OfferStatus;
use depth_image::{Camera, PinholeCamera, ViewCell};

/// One way to place the views; without any, an orbit of 24.
#[derive(Debug, Args)]
#[group(multiple = false)]
pub(super) struct Viewpoints {
    /// N views on an ellipse between the sample cameras
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) orbit: Option<u32>,
    /// Columns × rows of views on the rectangle of the sample cameras
    #[arg(long, value_name = "CxR")]
    pub(super) grid: Option<GridSize>,
    /// N views spread evenly on the rectangle of the sample cameras
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) views: Option<u32>,
    /// N views on a circle around the scene, at the height of the sample cameras' centre; implies --cells
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
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
        let near_m = (offer.volume.size().length() * NEAR_OF_DIAGONAL).max(1e-6);
        let placement = Placement { origin_in_source: offer.origin_in_source, near_m };
        if let Some(path) = &self.cameras {
            return Ok(camera_file::read(path, placement)?);
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
