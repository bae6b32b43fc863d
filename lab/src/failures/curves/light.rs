//! Light by rays: their number, contact and the terminator.

use depth_image::{DepthImage, Environment, Illumination, Light, PinholeCamera, linear_from_rgb9e5};
use fixtures::{quad, uv_sphere};
use glam::{Affine3A, Vec3};
use render::{GpuScene, Lighting, SamplePlanes};
use scene::procedural::courtyard;
use scene::{Instance, Scene};

use crate::failures::curve::{Curve, FLIP, Rows, Series, X, rows};
use crate::failures::measures::{foreground, share};
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Stage, YARD, looking};
use crate::failures::stand::Stand;

/// Rays of the truth.
const TRUE_RAYS: u32 = 512;

pub const CURVES: [Curve; 3] = [
    Curve {
        name: "Picture error against rays of light",
        subject: "a courtyard under a wide lamp, sampled and reconstructed",
        x: X::log("rays a pixel and lamp", "", &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0]),
        y: FLIP,
        series: &[Series::new("soft N, joint_carve", &[Shape::FallsThenFlat { least_fall: 0.01, tolerance: 0.003 }])],
        why: "Noise of samples falls with rays, until the reconstruction's own error is all that stays.",
        measure: by_rays,
    },
    Curve {
        name: "Contact shadow against the gap",
        subject: "a sheet over a floor under a sun",
        x: X::log("gap", "footprints", &[2.5e-4, 1e-3, 3.90625e-3, 0.015625, 0.0625, 0.25, 1.0]),
        y: ["floor under the sheet in shadow", ""],
        series: &[Series::new(
            "shadows",
            &[Shape::rises(0.5, 0.02), Shape::EqualAt { x: 0.0625, y: 1.0, tolerance: 0.01 }],
        )],
        why: "Rays begin a little above the surface, so that it does not shadow itself: below this bias nothing is met.",
        measure: by_gap,
    },
    Curve {
        name: "Terminator against the mesh",
        subject: "a sphere with smooth normals under a slanting sun",
        x: X::log("segments", "", &[8.0, 16.0, 32.0, 64.0, 128.0]),
        y: ["lit side in its own shadow", ""],
        series: &[Series::new(
            "shadows",
            &[Shape::falls(0.03, 0.0), Shape::EqualAt { x: 128.0, y: 0.0, tolerance: 0.02 }],
        )],
        why: "Normals are smooth, facets are flat: where light grazes, a facet that faces away shadows what the normals call lit.",
        measure: by_segments,
    },
];

fn soft(rays: u32) -> anyhow::Result<Lighting> {
    Ok(format!("soft {rays}").parse()?)
}

fn lamp(light: Light) -> Illumination {
    Illumination { lights: vec![light], environment: Environment::default() }
}

/// A courtyard under a square lamp that is twice as wide as the courtyard's diagonal.
fn yard_under_a_lamp() -> Scene {
    let mut scene = courtyard();
    let bounds = scene.bounds();
    let diagonal_m = bounds.size().length();
    scene.illumination = lamp(Light::Rectangle {
        center_in_world: bounds.center() + Vec3::Y * diagonal_m,
        half_edges_in_world: [Vec3::X * diagonal_m, Vec3::Z * diagonal_m],
        radiance_linear: Vec3::splat(0.25),
    });
    scene
}

fn sun(towards: Vec3) -> Illumination {
    lamp(Light::Directional {
        towards_light_in_world: towards.normalize_or(Vec3::Y),
        irradiance_linear: Vec3::ONE,
        angular_radius_rad: 0.0,
    })
}

/// A white floor of two metres at the origin.
fn floor(illumination: Illumination) -> Scene {
    let mut scene = quad(Vec3::ZERO, 1.0, Vec3::Y, [255; 3]);
    scene.materials[0].unlit = false;
    Scene { illumination, ..scene }
}

fn image(stand: &Stand, scene: &GpuScene, lighting: Lighting, camera: &PinholeCamera) -> anyhow::Result<DepthImage> {
    Ok(stand.images(scene, lighting, &[(*camera).into()], SamplePlanes::default())?.remove(0))
}

/// Linear green light at each sample, with its place.
fn lit_points(image: &DepthImage) -> Vec<(Vec3, f32)> {
    let size_px = image.size_px();
    let places = (0..size_px.y).flat_map(|y| (0..size_px.x).map(move |x| (x, y)));
    let lit = places.filter_map(|(x, y)| {
        let color = linear_from_rgb9e5(image.color_rgb9e5[(y * size_px.x + x) as usize]);
        Some((image.sample_in_world(x, y)?, color.y))
    });
    lit.collect()
}

fn by_rays(stand: &Stand, rays: &[f64]) -> anyhow::Result<Rows> {
    let scene = yard_under_a_lamp();
    let samples = YARD.samples(4, stand.sample_px);
    let cameras = YARD.views(stand.view_px);
    let truths = Stage::new(stand, &scene, &[])?.relit(soft(TRUE_RAYS)?, &[])?.truth(&cameras)?;
    rows(rays, |rays| {
        let stage = Stage::new(stand, &scene, &[])?.relit(soft(rays as u32)?, &samples)?;
        Ok([foreground(&truths, &stage.views(&cameras, CARVE)?)?.flip])
    })
}

fn by_gap(stand: &Stand, gaps: &[f64]) -> anyhow::Result<Rows> {
    let camera = looking(Vec3::new(0.0, 1.2, 1.2), Vec3::ZERO, 52.0, stand.view_px);
    // At the distance of the sheet's middle.
    let footprint_m = 1.7 / camera.focal_px.y;
    rows(gaps, |gap| {
        let mut scene = floor(sun(Vec3::Y));
        // The sheet faces down: the eye sees through it.
        let sheet = quad(Vec3::Y * gap as f32 * footprint_m, 0.3, Vec3::NEG_Y, [255; 3]);
        scene.meshes.extend(sheet.meshes);
        scene.instances.push(Instance { mesh: 1, world_from_mesh: Affine3A::IDENTITY });
        let lit = lit_points(&image(stand, &stand.upload(&scene)?, "shadows".parse()?, &camera)?);
        let under = lit.iter().filter(|(p, _)| p.y.abs() < 1e-6 && p.x.abs().max(p.z.abs()) < 0.2);
        Ok([share(under.map(|(_, light)| *light == 0.0))])
    })
}

fn by_segments(stand: &Stand, segments: &[f64]) -> anyhow::Result<Rows> {
    let camera = looking(Vec3::Z * 4.0, Vec3::ZERO, 40.0, stand.view_px);
    rows(segments, |segments| {
        let scene = Scene { illumination: sun(Vec3::new(1.0, 0.37, 0.21)), ..uv_sphere(1.0, segments as u32) };
        let scene = stand.upload(&scene)?;
        let plain = lit_points(&image(stand, &scene, "phong".parse()?, &camera)?);
        let shadowed = lit_points(&image(stand, &scene, "shadows".parse()?, &camera)?);
        let facing = plain.iter().zip(&shadowed).filter(|((_, plain), _)| *plain > 0.0);
        Ok([share(facing.map(|(_, (_, shadowed))| *shadowed == 0.0))])
    })
}
