//! Views from cubes beside views from depth images: errors, loads and time.

use gpu::Turn;
use std::time::Instant;

use anyhow::Context as _;
use depth_image::{Antialias, Camera, PinholeCamera, View, ViewPlanes};
use glam::Vec3;
use metrics::{PictureErrors, Rgb8Image, depth_errors};
use reconstruction::{ReconstructRequest, ReconstructionMethod, SampleSet};
use render::SamplePlanes;
use report::{Bar, Cell, Check, Table};

use super::subject::Subject;
use crate::failures::stage::CARVE;
use crate::statistics::median;

pub const LAYERED: ReconstructionMethod = ReconstructionMethod::LAYERED;
/// Views of a batch that is timed, and the times; the median counts.
const BATCH: usize = 8;
const REPEATS: usize = 5;
/// Between neighbouring sample cameras of the carve, as seen from the scene's middle, and their density over that of the view.
const SPREAD_RAD: f32 = 0.06;
const DENSITY: u32 = 2;
pub const PLAIN: SamplePlanes = SamplePlanes {
    antialias: Antialias::NONE,
    normal: false,
    surface_id: false,
    specular: true,
    corners: false,
    light: false,
};

/// Means over views of a scene, and the seconds of a view.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    pub psnr_db: f64,
    pub worst_psnr_db: f64,
    pub flip: f64,
    pub wrong_hits: f64,
    pub missed: f64,
    /// Nodes that a ray of the paper's ways loads; they are not counted for other methods.
    pub loads: Option<f64>,
    pub view_s: f64,
}

/// Of rows by [`Figures::row`].
pub const COLUMNS: [(&str, &str); 9] = [
    ("scene", ""),
    ("views by", ""),
    ("PSNR", "dB"),
    ("worst PSNR", "dB"),
    ("FLIP", ""),
    ("wrong hits", "%"),
    ("missed", "%"),
    ("loads a ray", ""),
    ("a view", "ms"),
];

pub fn table() -> Table {
    Table::new("Views: errors over the pixels that show a surface", &COLUMNS)
}

impl Figures {
    pub fn row(&self, name: &str, by: &str) -> Vec<Cell> {
        vec![
            name.into(),
            by.into(),
            self.psnr_db.into(),
            self.worst_psnr_db.into(),
            self.flip.into(),
            (self.wrong_hits * 100.0).into(),
            (self.missed * 100.0).into(),
            self.loads.into(),
            (self.view_s * 1e3).into(),
        ]
    }
}

/// Views around the scene from a cube.
///
/// # Errors
/// The device fails.
pub fn of_cube(subject: &Subject<'_>, set: &SampleSet) -> anyhow::Result<Figures> {
    let views = made(subject, set, &subject.views, LAYERED)?;
    figures(&subject.truths, &views, view_s(subject, set, LAYERED)?)
}

/// Views between four sample cameras from their depth images, one set for each place.
///
/// # Errors
/// The device fails.
pub fn of_images(subject: &Subject<'_>) -> anyhow::Result<Figures> {
    let mut views = Vec::new();
    for camera in &subject.views {
        views.extend(made(subject, &images_around(subject, camera)?, &[*camera], CARVE)?);
    }
    let set = images_around(subject, subject.views.first().context("a view")?)?;
    figures(&subject.truths, &views, view_s(subject, &set, CARVE)?)
}

fn images_around(subject: &Subject<'_>, camera: &PinholeCamera) -> anyhow::Result<SampleSet> {
    let places = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    let cameras: Vec<Camera> =
        places.iter().map(|&(x, y)| beside(subject, camera, x, y).resized(camera.size_px * DENSITY).into()).collect();
    let images = subject.stand.images(&subject.on_device, subject.lighting, &cameras, PLAIN)?;
    Ok(subject.stand.reconstructor().upload(&images, &subject.description(), Turn::default())?)
}

/// A camera beside another, which looks at the scene's middle, too.
fn beside(subject: &Subject<'_>, camera: &PinholeCamera, right: f32, up: f32) -> PinholeCamera {
    let middle = subject.scene.bounds().center();
    let half_m = camera.eye_in_world.distance(middle) * SPREAD_RAD * 0.5;
    let offset = camera.world_from_camera * Vec3::new(right * half_m, up * half_m, 0.0);
    let fov_y_rad = 2.0 * (0.5 * camera.size_px.y as f32 / camera.focal_px.y).atan();
    let aimed = PinholeCamera::looking_at(camera.eye_in_world + offset, middle, Vec3::Y, fov_y_rad, camera.size_px);
    PinholeCamera { near_m: camera.near_m, ..aimed }
}

/// Views with depth.
///
/// # Errors
/// The device fails.
pub fn made(
    subject: &Subject<'_>,
    set: &SampleSet,
    cameras: &[PinholeCamera],
    method: ReconstructionMethod,
) -> anyhow::Result<Vec<View>> {
    let planes = ViewPlanes::WITH_DEPTH;
    let request = ReconstructRequest { planes, ..ReconstructRequest::new(set, cameras, method) };
    Ok(subject.stand.reconstructor().reconstruct(request)?)
}

/// The median seconds of a view, of views between the places of the first view's sample cameras.
fn view_s(subject: &Subject<'_>, set: &SampleSet, method: ReconstructionMethod) -> anyhow::Result<f64> {
    let first = subject.views.first().context("a view")?;
    let cameras: Vec<PinholeCamera> =
        (0..BATCH).map(|at| beside(subject, first, 0.25 * at as f32 - 0.9, 0.1)).collect();
    let make = || subject.stand.reconstructor().reconstruct(ReconstructRequest::new(set, &cameras, method));
    make()?;
    let timed = || -> anyhow::Result<f64> {
        let start = Instant::now();
        make()?;
        Ok(start.elapsed().as_secs_f64() / BATCH as f64)
    };
    Ok(median((0..REPEATS).map(|_| timed()).collect::<anyhow::Result<_>>()?))
}

/// Of views beside the truth.
///
/// # Errors
/// Views of other sizes.
pub fn figures(truths: &[View], views: &[View], view_s: f64) -> anyhow::Result<Figures> {
    let worst_psnr_db = f64::INFINITY;
    let mut all = Figures { psnr_db: 0.0, worst_psnr_db, flip: 0.0, wrong_hits: 0.0, missed: 0.0, loads: None, view_s };
    for (truth, view) in truths.iter().zip(views) {
        let [foreground, _] = PictureErrors::of(truth, &Rgb8Image::of_view(view)?)?;
        let depths = [truth, view].map(|view| view.inverse_depth_per_m.as_deref().unwrap_or_default());
        let depth = depth_errors(depths[0], depths[1], None)?;
        let share = 1.0 / truths.len() as f64;
        all.psnr_db += share * foreground.psnr_db;
        all.worst_psnr_db = all.worst_psnr_db.min(foreground.psnr_db);
        all.flip += share * foreground.flip;
        all.wrong_hits += share * depth.wrong_hit_rate.unwrap_or(0.0);
        all.missed += share * (depth.wrong_miss_px + depth.unknown_px) as f64 / depth.foreground_px.max(1) as f64;
    }
    Ok(all)
}

/// The bounds of the walk's cost over the carve's, by the side of the cube.
pub fn cost_check(name: &str, side: u32, walk: &Figures, carve: &Figures) -> Option<Check> {
    let bar = match side {
        512 => 1.75,
        1024 => 3.5,
        _ => return None,
    };
    let name = format!("{name}: a view from a cube of {side}² over one by joint_carve");
    Some(Check::new(name, walk.view_s / carve.view_s, "", Bar::AtMost(bar)))
}
