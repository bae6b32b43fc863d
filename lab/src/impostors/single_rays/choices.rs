//! The choice of images for four reflectors, each at two distances from the teapot.

use std::collections::BTreeSet;

use fixtures::{quad, teapot_mirror, uv_sphere};
use glam::{Affine3A, Quat, UVec2, Vec3};
use reconstruction::RayWork;
use render::scalar;
use report::{Bar, Cell, Check, Table};
use sampling::{Impostors, Mirror};
use scene::{Instance, Mesh, Scene};

use super::bowl::bowl;
use super::teapot::{NEAR_M, mirrored, unlit_set};
use crate::failures::stand::Stand;
use crate::impostors::candidates::in_a_cluster;
use crate::impostors::measure::around;
use crate::statistics::median;

/// How far a reflector stands from its place in `teapot-mirror`, metres.
const DISTANCES_M: [f32; 2] = [0.0, 4.0];
const VIEWS: usize = 4;
const VIEW_PX: UVec2 = UVec2::new(200, 150);
const REPEATS: usize = 5;
/// The most images of a mirror.
const MOST_IMAGES: u32 = 8;
/// The unseen share that is to be kept, in percent; several numbers of images keep it.
const UNSEEN_PERCENT: f32 = 1.0;

/// Adds the table of all eight to a report, and its checks.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand) -> anyhow::Result<(Table, Vec<Check>)> {
    let columns = [
        ("reflector", ""),
        ("moved away", "m"),
        ("images", ""),
        ("unseen", "%"),
        ("of other rays", "%"),
        ("ns a ray", ""),
        ("over the cheapest that keeps 1 %", "×"),
    ];
    let mut table = Table::new("The choice for four reflectors, each at two distances", &columns);
    let (mut kept, mut images, mut dearest) = (0, BTreeSet::new(), 0.0f64);
    for (name, reflector, place) in reflectors() {
        for away_m in DISTANCES_M {
            let scene = before_teapot(&reflector, place, away_m);
            let (mirror, ns_a_ray, over) = priced(stand, &scene)?;
            let [chosen, fresh] = mirror.unseen_ratio.unwrap_or_default().map(|ratio| f64::from(ratio) * 100.0);
            kept += usize::from((fresh - chosen).abs() <= 1.0);
            images.insert(mirror.cameras.len());
            dearest = dearest.max(over);
            let numbers = [chosen, fresh, ns_a_ray, over].map(Cell::from);
            let named = [Cell::from(name), f64::from(away_m).into(), mirror.cameras.len().into()];
            table.push(named.into_iter().chain(numbers))?;
        }
    }
    let checks = vec![
        Check::new("choice: time over the cheapest that keeps the budget, most", dearest, "×", Bar::AtMost(1.1)),
        Check::new("choice: audits within a point, of eight", kept as f64, "", Bar::AtLeast(7.0)),
        Check::new("choice: different numbers of images", images.len() as f64, "", Bar::AtLeast(2.0)),
    ];
    Ok((table, checks))
}

/// Their names, meshes and places.
fn reflectors() -> Vec<(&'static str, Mesh, Affine3A)> {
    let mesh = |scene: Scene| scene.meshes.into_iter().next().unwrap_or_default();
    let mut pebble = mesh(teapot_mirror());
    pebble.parts.remove(0);
    let behind = Vec3::new(0.0, 2.2, -3.5);
    let bowl_place = Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), Quat::from_rotation_x(1.57), behind);
    vec![
        ("dented pebble", pebble, Affine3A::IDENTITY),
        ("ball", mesh(uv_sphere(2.0, 96)), Affine3A::from_translation(behind)),
        ("plane", mesh(quad(Vec3::ZERO, 2.0, Vec3::Z, [255; 3])), Affine3A::from_translation(behind)),
        ("bowl", mesh(bowl()), bowl_place),
    ]
}

/// The teapot on its floor, before a reflector in the place of its mirror.
fn before_teapot(reflector: &Mesh, place: Affine3A, away_m: f32) -> Scene {
    let mut scene = teapot_mirror();
    scene.meshes[0].parts.truncate(1);
    let mut reflector = reflector.clone();
    reflector.parts.iter_mut().for_each(|part| part.material = 1);
    let world_from_mesh = Affine3A::from_translation(Vec3::NEG_Z * away_m) * place;
    scene.instances.push(Instance { mesh: scene.meshes.len() as u32, world_from_mesh });
    scene.meshes.push(reflector);
    scene
}

/// The mirror with its chosen images, the time of a ray in them, and that over the least of all numbers of images that keep the
/// budget.
fn priced(stand: &Stand, scene: &Scene) -> anyhow::Result<(Mirror, f64, f64)> {
    let mirror = |impostors| -> anyhow::Result<Mirror> {
        let (mirrors, _) = sampling::mirrors(scene, impostors);
        mirrors.into_iter().next().ok_or_else(|| anyhow::anyhow!("no mirror"))
    };
    let chosen = mirror(Impostors::Auto { unseen_percent: UNSEEN_PERCENT })?;
    let on_device = stand.upload(scene)?;
    let twin = scalar::rays::Scene::of(&on_device, 0.0)?;
    let rays = mirrored(&twin, &around(&scene.bounds(), VIEWS), VIEW_PX);
    let ns_a_ray = |mirror: &Mirror| -> anyhow::Result<f64> {
        let set = unlit_set(stand, &on_device, &in_a_cluster(mirror), scene.bounds())?;
        let work = RayWork::new(&set, NEAR_M);
        let seconds = || Ok(stand.reconstructor().follow(work, &rays)?.1);
        seconds()?;
        let times = (0..REPEATS).map(|_| seconds()).collect::<anyhow::Result<Vec<f64>>>()?;
        Ok(median(times) * 1e9 / rays.len().max(1) as f64)
    };
    let own = ns_a_ray(&chosen)?;
    let mut least = own;
    for images in chosen.cameras.len() as u32 + 1..=MOST_IMAGES {
        let other = mirror(Impostors::Pinholes { images })?;
        let is_kept = other.unseen_ratio.is_some_and(|[unseen, _]| unseen * 100.0 <= UNSEEN_PERCENT);
        if is_kept && other.cameras.len() > chosen.cameras.len() {
            least = least.min(ns_a_ray(&other)?);
        }
    }
    Ok((chosen, own, own / least))
}
