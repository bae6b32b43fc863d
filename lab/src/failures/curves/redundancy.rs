//! Redundant samples: triangles of a texel's size, floors at a grazing angle, and jitter. Layers from one place.

use depth_image::{DepthImage, PinholeCamera};
use fixtures::{poles, quad};
use glam::{Affine3A, Vec3};
use render::GpuScene;
use sampling::{Redundancy, SamplingMethod};
use scene::Instance;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{samples, share};
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;
use crate::sampling_study::found_redundant;

const TESTS: [SamplingMethod; 3] = [
    SamplingMethod::NonRedundant(Redundancy::Pixel),
    SamplingMethod::NonRedundant(Redundancy::Visibility),
    SamplingMethod::NonRedundant(Redundancy::Coverage),
];
const ALL: &[Shape] = &[Shape::Bounded { least: 0.95, most: 1.0 }];

pub const CURVES: [Curve; 4] = [
    Curve {
        name: "Redundant samples found against triangles",
        subject: "a tessellated wall that two images see whole",
        x: X::log("leg of triangles", "texels", &[0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 64.0])
            .with_small(&[0.5, 1.0, 2.0, 4.0, 16.0, 64.0]),
        y: ["redundant samples found", ""],
        series: &[
            Series::new("pixel", &[Shape::rises(0.5, 0.03)]),
            Series::new("visibility", ALL),
            Series::new("coverage", ALL),
        ],
        why: "Another image seldom meets a triangle that is smaller than a texel at its texel: its samples are kept twice.",
        measure: by_leg,
    },
    Curve {
        name: "A floor's samples omitted against the angle",
        subject: "two triangles, first at an angle, then from above",
        x: X::linear("angle from upright", "°", &[0.0, 45.0, 60.0, 80.0, 85.0, 88.0, 89.0, 89.9]),
        y: ["share of the second image omitted", ""],
        series: &[
            Series::new("pixel", &[Shape::falls(0.2, 0.02), Shape::EqualAt { x: 85.0, y: 0.9, tolerance: 0.1 }]),
            Series::new("visibility", ALL),
            Series::new("coverage", &[Shape::falls(0.8, 0.02), Shape::EqualAt { x: 80.0, y: 0.0, tolerance: 0.05 }]),
        ],
        why: "Two large triangles are the same triangles however few texels of the first image they fill; only the coverage compares footprints.",
        measure: by_angle,
    },
    Curve {
        name: "Flicker against jitter",
        subject: "nine poles before a wall, the second of two cameras moved",
        x: X::linear("jitter", "texels", &[0.0, 0.05, 0.1, 0.25, 0.5]),
        y: ["texels that change between kept and omitted", ""],
        series: &[
            Series::new("pixel", &[Shape::rises(0.01, 0.01), STILL, Shape::Bounded { least: 0.0, most: 0.1 }]),
            Series::new("visibility", &[STILL, Shape::Bounded { least: 0.0, most: 0.05 }]),
            Series::new("coverage", &[STILL, Shape::Bounded { least: 0.0, most: 0.1 }]),
        ],
        why: "Tests by texel flip where a texel's triangle changes; what stands still does not flicker.",
        measure: by_jitter,
    },
    Curve {
        name: "A wall peeled from near its plane",
        subject: "a wall before another, four layers from one place",
        x: X::linear("distance from the wall's plane", "m", &[0.0, 0.05, 0.1, 0.2, 0.4, 0.8]),
        y: ["samples of the wall, of a layer's texels", ""],
        series: &[Series::new(
            "depth_peeling:4",
            &[Shape::rises(0.01, 0.0), Shape::EqualAt { x: 0.0, y: 0.0, tolerance: 0.0 }],
        )],
        why: "Layers from one place share its blind spots: a wall that is seen edge-on is in none of them.",
        measure: by_distance,
    },
];

const STILL: Shape = Shape::EqualAt { x: 0.0, y: 0.0, tolerance: 0.0 };

fn by_leg(stand: &Stand, legs_px: &[f64]) -> anyhow::Result<Rows> {
    rows(legs_px, |leg_px| found_redundant(stand.engine(), leg_px as f32))
}

fn by_angle(stand: &Stand, angles_deg: &[f64]) -> anyhow::Result<Rows> {
    let scene = stand.upload(&quad(Vec3::ZERO, 1.0, Vec3::Y, [200; 3]))?;
    let above = PinholeCamera::looking_at(Vec3::Y * 3.0, Vec3::ZERO, Vec3::NEG_Z, 0.6, stand.sample_px);
    let whole = samples(&stand.sample(&scene, &[above], SamplingMethod::CONVENTIONAL)?[0]);
    rows(angles_deg, |angle_deg| {
        let (sin, cos) = f32::sin_cos((angle_deg as f32).to_radians());
        let up = Vec3::new(0.0, 0.3, -1.0);
        let first = PinholeCamera::looking_at(Vec3::new(0.01, cos, sin) * 3.0, Vec3::ZERO, up, 0.6, stand.sample_px);
        let mut omitted = [0.0; 3];
        for (omitted, method) in omitted.iter_mut().zip(TESTS) {
            let kept = samples(&stand.sample(&scene, &[first, above], method)?[1]);
            *omitted = 1.0 - kept as f64 / whole as f64;
        }
        Ok(omitted)
    })
}

fn by_jitter(stand: &Stand, jitters_px: &[f64]) -> anyhow::Result<Rows> {
    let scene = stand.upload(&poles(0.05))?;
    let texel_m = 6.0 / camera_of_poles(stand, 0.0).focal_px.x;
    rows(jitters_px, |jitter_px| {
        let mut flips = [0.0; 3];
        for (flips, method) in flips.iter_mut().zip(TESTS) {
            let still = second_image(stand, &scene, method, 0.0)?;
            let moved = second_image(stand, &scene, method, jitter_px as f32 * texel_m)?;
            let pairs = still.inverse_depth_per_m.iter().zip(&moved.inverse_depth_per_m);
            *flips = share(pairs.map(|(a, b)| (*a > 0.0) != (*b > 0.0)));
        }
        Ok(flips)
    })
}

/// The second of two images, its camera moved.
fn second_image(stand: &Stand, scene: &GpuScene, method: SamplingMethod, moved_m: f32) -> anyhow::Result<DepthImage> {
    let cameras = [-0.4, 0.4 + moved_m].map(|x| camera_of_poles(stand, x));
    Ok(stand.sample(scene, &cameras, method)?.remove(1))
}

fn camera_of_poles(stand: &Stand, x: f32) -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(x, 0.0, 4.0), Vec3::NEG_Z * 2.0, Vec3::Y, 0.8, stand.sample_px)
}

fn by_distance(stand: &Stand, distances_m: &[f64]) -> anyhow::Result<Rows> {
    let mut scene = quad(Vec3::new(0.0, 0.0, -4.0), 2.0, Vec3::Z, [200; 3]);
    scene.meshes.extend(quad(Vec3::new(0.0, 0.0, -2.0), 0.8, Vec3::X, [200, 40, 40]).meshes);
    scene.instances.push(Instance { mesh: 1, world_from_mesh: Affine3A::IDENTITY });
    let scene = stand.upload(&scene)?;
    rows(distances_m, |x| {
        let eye = Vec3::new(x as f32, 0.0, 3.0);
        let camera = PinholeCamera::looking_at(eye, Vec3::NEG_Z * 2.0, Vec3::Y, 0.9, stand.sample_px);
        let images = stand.sample(&scene, &[camera; 4], SamplingMethod::DepthPeeling { layers: 4 })?;
        let texels =
            images.iter().flat_map(|image| image.inverse_depth_per_m.iter().zip(image.surface_id.iter().flatten()));
        let of_wall = texels.filter(|(depth, id)| **depth > 0.0 && id.instance == 1).count();
        Ok([of_wall as f64 / camera.pixel_count() as f64])
    })
}
