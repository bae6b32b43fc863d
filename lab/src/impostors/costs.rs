//! What mirrors that show the scene cost, in views of which they fill two fifths.

use std::time::Instant;

use anyhow::Context as _;
use depth_image::{Aabb, PinholeCamera, ViewPlanes};
use glam::{UVec2, Vec3};
use reconstruction::{Mirrors, ReconstructRequest};
use sampling::Mirror;

use super::candidates::in_a_cluster;
use super::measure::{Hall, VIEW_PX, cells, plain, reflecting};
use crate::failures::stage::CARVE;
use crate::statistics::median;

/// The share of a view that the mirror fills.
const FILLED: f32 = 0.4;
const FOV_Y_RAD: f32 = 0.5;
/// Views of a batch, and the times that it is made; the median counts.
const BATCH: usize = 8;
const REPEATS: usize = 5;
/// Directly drawn views that are timed.
const DRAWN: usize = 2;
/// The side of a view's sample images over that of the view.
const DENSITY: u32 = 2;
/// The angle between neighbouring sample cameras, as seen from the mirror.
const SPREAD_RAD: f32 = 0.06;

/// Seconds.
#[derive(Debug, Clone, Copy)]
pub struct Costs {
    /// The four images of views, and those of mirrors.
    pub sample_s: [f64; 2],
    /// Until the set of views, and those of mirrors, are on the device.
    pub load_s: [f64; 2],
    /// A view by the light of the views: without reflections, with one, with two.
    pub view_s: [f64; 3],
    /// A view that is drawn directly, with as many.
    pub direct_s: [f64; 3],
    /// The share of pixels from which rays are followed.
    pub mirror_ratio: f64,
}

impl Costs {
    /// The throughput of views from samples over that of directly drawn ones, as the parts allow it on one node.
    pub fn gain(&self, views: f64, reflections: usize) -> f64 {
        let kinds = if reflections > 0 { 2 } else { 1 };
        let once_s: f64 = self.sample_s[..kinds].iter().chain(&self.load_s[..kinds]).sum();
        views * self.direct_s[reflections] / (once_s + views * self.view_s[reflections])
    }
}

/// The costs of views near the first of these mirrors.
///
/// # Errors
/// The device fails.
pub fn measure(hall: &Hall<'_>, mirrors: &[Mirror]) -> anyhow::Result<Costs> {
    let bounds: Vec<Aabb> = mirrors.iter().map(|mirror| mirror.bounds).collect();
    let Some(near) = bounds.first() else { anyhow::bail!("the scene has no mirrors") };
    let places = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
    let samples = places.map(|(x, y)| before(near, x * SPREAD_RAD, y * SPREAD_RAD).resized(VIEW_PX * DENSITY).into());
    let views: Vec<PinholeCamera> =
        (0..BATCH).map(|at| before(near, SPREAD_RAD * (0.25 * at as f32 - 0.9), 0.02)).collect();
    // The first use of a light builds shaders.
    hall.images(&samples)?;
    let (images, views_s) = timed(|| hall.images(&samples))?;
    let (of_mirrors, mirrors_s) =
        timed(|| mirrors.iter().map(|mirror| hall.images(&in_a_cluster(mirror))).collect::<anyhow::Result<Vec<_>>>())?;
    let load = || hall.set(&images, false);
    let load_mirrors = || of_mirrors.iter().map(|images| hall.set(images, true)).collect::<anyhow::Result<Vec<_>>>();
    // A cluster's later sets reuse the memory of earlier ones.
    drop((load()?, load_mirrors()?));
    let ((set, load_s), (sets, load_mirrors_s)) = (timed(load)?, timed(load_mirrors)?);
    let cells = cells(&bounds, &sets);
    let view_s = |reflections| -> anyhow::Result<f64> {
        let mirrors = Mirrors { cells: &cells, reflections, glossy_rays: 0 };
        let reconstructor = hall.stand.reconstructor();
        let turn = Default::default();
        let make = || {
            Ok(reconstructor.reconstruct(ReconstructRequest {
                common: mirrors.into(),
                turn,
                ..ReconstructRequest::new(&set, &views, CARVE)
            })?)
        };
        make()?;
        let times = (0..REPEATS).map(|_| Ok(timed(make)?.1 / BATCH as f64)).collect::<anyhow::Result<Vec<f64>>>()?;
        Ok(median(times))
    };
    let direct_s = |reflections| direct_s(hall, &views[..DRAWN], reflections);
    Ok(Costs {
        sample_s: [views_s, mirrors_s],
        load_s: [load_s, load_mirrors_s],
        view_s: [view_s(0)?, view_s(1)?, view_s(2)?],
        direct_s: [direct_s(0)?, direct_s(1)?, direct_s(2)?],
        mirror_ratio: mirror_ratio(hall, near, &views[0])?,
    })
}

/// A view of a mirror that fills [`FILLED`] of it, from a little aside.
fn before(mirror: &Aabb, right_rad: f32, up_rad: f32) -> PinholeCamera {
    let radius_m = 0.5 * mirror.size().max_element();
    let half_height = (FOV_Y_RAD * 0.5).tan();
    let aspect = VIEW_PX.x as f32 / VIEW_PX.y as f32;
    let slope = (FILLED * 4.0 * aspect * half_height * half_height / std::f32::consts::PI).sqrt();
    let distance_m = radius_m / slope.atan().sin();
    let towards = Vec3::new(right_rad.sin(), 0.15 + up_rad, right_rad.cos()).normalize_or(Vec3::Z);
    let middle = mirror.center();
    PinholeCamera::looking_at(middle + towards * distance_m, middle, Vec3::Y, FOV_Y_RAD, VIEW_PX)
}

fn direct_s(hall: &Hall<'_>, views: &[PinholeCamera], reflections: u32) -> anyhow::Result<f64> {
    let lighting = reflecting(hall.lighting, reflections)?;
    let draw = || hall.stand.views(&hall.on_device, lighting, views, ViewPlanes::COLOR);
    draw()?;
    Ok(timed(draw)?.1 / views.len() as f64)
}

/// The share of pixels that show what lies within a mirror's bounds.
fn mirror_ratio(hall: &Hall<'_>, mirror: &Aabb, camera: &PinholeCamera) -> anyhow::Result<f64> {
    let views = hall.stand.views(&hall.on_device, plain(hall.lighting), &[*camera], ViewPlanes::WITH_DEPTH)?;
    let depths = views.first().and_then(|view| view.inverse_depth_per_m.as_ref()).context("depth")?;
    let shows_mirror = |(index, inverse_depth_per_m): (usize, &f32)| {
        let pixel = UVec2::new(index as u32 % camera.size_px.x, index as u32 / camera.size_px.x);
        let ray = camera.ray(pixel.as_vec2() + 0.5);
        let point_in_world = ray.origin_in_world + ray.direction_in_world / *inverse_depth_per_m;
        *inverse_depth_per_m > 0.0 && point_in_world.clamp(mirror.min, mirror.max) == point_in_world
    };
    Ok(depths.iter().enumerate().filter(|at| shows_mirror(*at)).count() as f64 / depths.len() as f64)
}

fn timed<T>(run: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<(T, f64)> {
    let start = Instant::now();
    let done = run()?;
    Ok((done, start.elapsed().as_secs_f64()))
}
