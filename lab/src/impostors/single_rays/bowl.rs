//! Rays that a concave mirror sends to itself: the images of its cell must see it, and a ray must not end where it begins.

use depth_image::{PinholeCamera, ProvenanceKind};
use fixtures::uv_sphere;
use glam::{UVec2, Vec3};
use reconstruction::RayWork;
use render::scalar;
use report::{Bar, Check};
use scene::{Material, Scene};

use super::teapot::{mirrored, unlit_set};
use crate::failures::stand::Stand;
use crate::impostors::candidates::in_a_cluster;

const VIEWS: usize = 6;
const VIEW_PX: UVec2 = UVec2::new(200, 150);
/// Where rays begin above the bowl: three pixels of the views, at grazing incidence.
const NEAR_M: f32 = 0.06;
/// Ends within this are right: a hundredth of the bowl's width.
const RIGHT_M: f32 = 0.02;
/// An end nearer than this is the mirror's own place.
const OWN_M: f32 = 0.1;

/// The lower half of a sphere of radius 1 m, which mirrors on its inside.
pub fn bowl() -> Scene {
    let mut bowl = uv_sphere(1.0, 96);
    let mesh = &mut bowl.meshes[0];
    let lies_low = |triangle: &&[u32; 3]| triangle.iter().all(|&at| mesh.vertices[at as usize].position[1] < 1e-4);
    let turned = |&[a, b, c]: &[u32; 3]| [a, c, b];
    mesh.indices = mesh.indices.as_chunks::<3>().0.iter().filter(lies_low).flat_map(turned).collect();
    mesh.parts[0].index_count = mesh.indices.len() as u32;
    for vertex in &mut mesh.vertices {
        vertex.normal = vertex.normal.map(|of_axis| -of_axis);
    }
    bowl.materials[0] = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    bowl
}

/// Views into the bowl.
fn views() -> Vec<PinholeCamera> {
    let camera = |number: usize| {
        let (sin, cos) = (std::f32::consts::TAU * number as f32 / VIEWS as f32).sin_cos();
        PinholeCamera::looking_at(Vec3::new(1.5 * sin, 2.0, 1.5 * cos), Vec3::Y * -0.5, Vec3::Y, 0.6, VIEW_PX)
    };
    (0..VIEWS).map(camera).collect()
}

/// The share of second hits that are found, and ends at the mirror's own place.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand) -> anyhow::Result<[Check; 2]> {
    let scene = bowl();
    let on_device = stand.upload(&scene)?;
    let twin = scalar::rays::Scene::of(&on_device, 0.0)?;
    let (mirrors, _) = sampling::mirrors(&scene, sampling::Impostors::default());
    let mirror = mirrors.first().ok_or_else(|| anyhow::anyhow!("the bowl is no mirror"))?;
    let set = unlit_set(stand, &on_device, &in_a_cluster(mirror), scene.bounds())?;
    let rays = mirrored(&twin, &views(), VIEW_PX);
    let work = RayWork::new(&set, NEAR_M);
    let (ends, _) = stand.reconstructor().follow(work, &rays)?;
    let (mut second, mut found, mut own) = (0usize, 0usize, 0usize);
    for (ray, end) in rays.iter().zip(&ends) {
        let truth = twin.closest(ray, NEAR_M).0.map(|hit| hit.t);
        let is_hit = end.kind == ProvenanceKind::Hit;
        second += usize::from(truth.is_some());
        found += usize::from(is_hit && truth.is_some_and(|way_m| (way_m - end.way_m).abs() <= RIGHT_M));
        own += usize::from(is_hit && end.way_m < OWN_M && truth.is_none_or(|way_m| way_m > 2.0 * OWN_M));
    }
    anyhow::ensure!(second > 0, "no ray meets the bowl twice");
    let found_percent = 100.0 * found as f64 / second as f64;
    Ok([
        Check::new("concave bowl: second hits that are found", found_percent, "%", Bar::AtLeast(90.0)),
        Check::new("concave bowl: rays that end where they begin", own as f64, "", Bar::AtMost(0.0)),
    ])
}
