//! What is saved where rays meet flat images in closed form (Rosen et al., section 6.1: billboards).

use depth_image::{DepthImage, ProvenanceKind, Ray};
use glam::{UVec2, Vec2, Vec3};
use reconstruction::{RayEnd, RayWork, plane_of};
use render::{Lighting, SamplePlanes, scalar};
use sampling::Impostors;
use scene::procedural::teapot_mirror;
use study::{Bar, Cell, Check, Table};

use super::teapot::{NEAR_M, mirrored, unlit_set};
use crate::failures::stand::Stand;
use crate::impostors::candidates::in_a_cluster;
use crate::impostors::measure::around;
use crate::statistics::median;

const VIEWS: usize = 6;
const VIEW_PX: UVec2 = UVec2::new(200, 150);
const REPEATS: usize = 7;
/// Ways that differ by no more are alike, in ways.
const ALIKE: f32 = 0.01;
/// A sample shows a point if its depth is as near, in depths.
const SHOWN: f32 = 0.02;

/// A row for the chosen images of `teapot-mirror`, and the time of a ray over that without closed forms.
///
/// # Errors
/// The device fails, or the scene has no mirror.
pub fn measure(stand: &Stand) -> anyhow::Result<(Table, Check)> {
    let scene = teapot_mirror();
    let (mirrors, _) = sampling::mirrors(&scene, Impostors::default());
    let cameras = in_a_cluster(mirrors.first().ok_or_else(|| anyhow::anyhow!("no mirror"))?);
    let on_device = stand.upload(&scene)?;
    let images = stand.images(&on_device, Lighting::UNLIT, &cameras, SamplePlanes::default())?;
    let flat: Vec<&DepthImage> = images.iter().filter(|image| plane_of(image).is_some()).collect();
    let rays = mirrored(&scalar::rays::Scene::of(&on_device, 0.0)?, &around(&scene.bounds(), VIEWS), VIEW_PX);
    let set = |of_mirror| unlit_set(stand, &on_device, &cameras, (scene.bounds(), of_mirror));
    let [closed, searched] = [set(true)?, set(false)?];
    let follow = |set| stand.reconstructor().follow(RayWork::new(set, NEAR_M), &rays);
    let ends = follow(&closed)?.0;
    let alike = ends.iter().zip(&follow(&searched)?.0).filter(|(a, b)| are_alike(a, b)).count();
    let is_in_flat = |(ray, end): &(&Ray, &RayEnd)| {
        end.kind == ProvenanceKind::Hit && flat.iter().any(|image| shows(image, ray.at(end.way_m)))
    };
    let in_flat = rays.iter().zip(&ends).filter(is_in_flat).count();
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..REPEATS {
        times[0].push(follow(&closed)?.1);
        times[1].push(follow(&searched)?.1);
    }
    let count = rays.len() as f64;
    let [closed_ns, searched_ns] = times.map(|times| median(times) * 1e9 / count);
    let columns = [
        ("images", ""),
        ("flat", ""),
        ("rays that end in flat ones", "%"),
        ("ns a ray", ""),
        ("ns a ray without closed forms", ""),
        ("ends alike", "%"),
    ];
    let mut table = Table::new("Flat images among those of teapot-mirror", &columns);
    let percent = |rays: usize| 100.0 * rays as f64 / count;
    let numbers = [percent(in_flat), closed_ns, searched_ns, percent(alike)].map(Cell::from);
    table.push([cameras.len(), flat.len()].map(Cell::from).into_iter().chain(numbers))?;
    let over = closed_ns / searched_ns;
    Ok((table, Check::new("flat images: time of a ray over that without closed forms", over, "×", Bar::AtMost(1.0))))
}

fn are_alike(a: &RayEnd, b: &RayEnd) -> bool {
    let is_hit = a.kind == ProvenanceKind::Hit;
    a.kind == b.kind && (!is_hit || (a.way_m - b.way_m).abs() <= ALIKE * a.way_m)
}

/// Whether an image sees this point.
fn shows(image: &DepthImage, point_in_world: Vec3) -> bool {
    let size_px = image.size_px();
    let is_within = |pixel: Vec2| pixel.cmpge(Vec2::ZERO).all() && pixel.cmplt(size_px.as_vec2()).all();
    let Some(at) = image.camera.project(point_in_world).filter(|at| is_within(at.pixel)) else { return false };
    let place = at.pixel.as_uvec2();
    let inverse_depth_per_m = image.inverse_depth_per_m[(place.y * size_px.x + place.x) as usize];
    (inverse_depth_per_m * at.planar_depth_m - 1.0).abs() < SHOWN
}
