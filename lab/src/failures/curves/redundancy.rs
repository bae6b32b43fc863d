//! Redundant samples: triangles of a texel's size, floors at a grazing angle, tolerance, jitter and many instances.

use depth_image::{DepthImage, PinholeCamera};
use fixtures::{poles, quad};
use glam::{Affine3A, UVec2, Vec3};
use sampling::{Redundancy, SamplingMethod, scalar};
use scene::procedural::courtyard;
use scene::{Instance, Scene};

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{samples, share};
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;
use crate::sampling_study::found_redundant;

const TESTS: [SamplingMethod; 3] = [
    SamplingMethod::NonRedundant(Redundancy::Pixel),
    SamplingMethod::NonRedundant(Redundancy::Visibility),
    SamplingMethod::NonRedundant(Redundancy::Tolerance),
];
const ALL: &[Shape] = &[Shape::Bounded { least: 0.95, most: 1.0 }];

pub const CURVES: [Curve; 6] = [
    Curve {
        name: "Redundant samples found against triangles",
        subject: "a tessellated wall that two images see whole",
        x: X::log("leg of triangles", "texels", &[0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 64.0])
            .with_small(&[0.5, 1.0, 2.0, 4.0, 16.0, 64.0]),
        y: ["redundant samples found", ""],
        series: &[
            Series::new("pixel", &[Shape::rises(0.5, 0.03)]),
            Series::new("visibility", ALL),
            Series::new("tolerance", ALL),
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
            Series::new("tolerance", &[Shape::falls(0.9, 0.02), Shape::EqualAt { x: 80.0, y: 0.0, tolerance: 0.05 }]),
        ],
        why: "Two large triangles are the same triangles however few texels of the first image they fill; only the tolerance compares footprints.",
        measure: by_angle,
    },
    Curve {
        name: "Samples kept against the tolerance",
        subject: "a courtyard, two images, the twin",
        x: TOLERANCES,
        y: ["share of the second image kept", ""],
        series: &[Series::new("tolerance", &[Shape::falls(0.05, 1e-3)])],
        why: "More tolerance calls more samples redundant.",
        measure: kept_by_tolerance,
    },
    Curve {
        name: "Surfaces lost against the tolerance",
        subject: "a courtyard, two images, the twin",
        x: TOLERANCES,
        y: ["share of a view's surfaces that no image holds", ""],
        series: &[Series::new("tolerance", &[Shape::rises(0.002, 2e-3)])],
        why: "From the default on, walls that the other image met at a slant count as fine enough, and samples are omitted that no image holds.",
        measure: lost_by_tolerance,
    },
    Curve {
        name: "Flicker against jitter",
        subject: "nine poles before a wall, the second of two cameras moved",
        x: X::linear("jitter", "texels", &[0.0, 0.05, 0.1, 0.25, 0.5]),
        y: ["texels that change between kept and omitted", ""],
        series: &[
            Series::new("pixel", &[Shape::rises(0.01, 0.01), STILL, Shape::Bounded { least: 0.0, most: 0.1 }]),
            Series::new("visibility", &[STILL, Shape::Bounded { least: 0.0, most: 0.05 }]),
            Series::new("tolerance", &[STILL, Shape::Bounded { least: 0.0, most: 0.1 }]),
        ],
        why: "Tests by texel flip where a texel's triangle changes; what stands still does not flicker.",
        measure: by_jitter,
    },
    Curve {
        name: "Instances told apart",
        subject: "up to 10,000 instances of a square, two images",
        x: X::log("instances", "", &[10.0, 100.0, 1000.0, 10_000.0]).with_small(&[10.0, 100.0, 1000.0]),
        y: ["instances sampled, of those in view", ""],
        series: &[Series::new("pixel", &[Shape::Bounded { least: 0.999, most: 1.0 }])],
        why: "The key of a sample is instance and primitive: no instance stands for another.",
        measure: by_instances,
    },
];

const STILL: Shape = Shape::EqualAt { x: 0.0, y: 0.0, tolerance: 0.0 };
const TOLERANCES: X = X::log("allowed difference, over the default", "", &[0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0])
    .with_small(&[0.125, 0.5, 1.0, 2.0, 8.0]);

fn by_leg(stand: &Stand, legs_px: &[f64]) -> anyhow::Result<Rows> {
    rows(legs_px, |leg_px| found_redundant(stand.engine(), leg_px as f32))
}

fn by_angle(stand: &Stand, angles_deg: &[f64]) -> anyhow::Result<Rows> {
    let scene = stand.upload(&quad(Vec3::ZERO, 1.0, Vec3::Y, [200; 3]))?;
    let above = PinholeCamera::looking_at(Vec3::Y * 3.0, Vec3::ZERO, Vec3::NEG_Z, 0.6, stand.sample_px);
    let whole = samples(&stand.sample(&scene, &[above], SamplingMethod::CONVENTIONAL)?[0]);
    rows(angles_deg, |angle_deg| {
        let (sin, cos) = (angle_deg as f32).to_radians().sin_cos();
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

/// The share of the second image that is kept, and of a view's surfaces that no image holds.
fn by_tolerance(stand: &Stand, factors: &[f64]) -> anyhow::Result<Vec<[f64; 2]>> {
    let scene = courtyard();
    let rays = render::scalar::rays::Scene::of(&stand.upload(&scene)?, 0.0)?;
    let (center, reach) = (scene.bounds().center(), scene.bounds().size().length());
    let size_px = stand.view_px;
    let camera =
        |x: f32| PinholeCamera::looking_at(center + Vec3::new(x, 0.5, 0.9) * reach, center, Vec3::Y, 0.7, size_px);
    let view = scalar::sample(&rays, &[camera(0.05)], SamplingMethod::CONVENTIONAL).remove(0);
    let row = |&factor: &f64| {
        let settings = scalar::Settings { allowed: factor as f32, ..scalar::Settings::default() };
        let images = scalar::sample_with(&rays, &[camera(-0.15), camera(0.2)], TESTS[2], settings);
        let lost = metrics::unheld_rate(&camera(0.05), &view.inverse_depth_per_m, &images)?;
        let kept = samples(&images[1]) as f64 / images[1].inverse_depth_per_m.len() as f64;
        Ok([kept, lost.unwrap_or(f64::NAN)])
    };
    factors.iter().map(row).collect()
}

fn kept_by_tolerance(stand: &Stand, factors: &[f64]) -> anyhow::Result<Rows> {
    Ok(by_tolerance(stand, factors)?.into_iter().map(|[kept, _]| vec![kept]).collect())
}

fn lost_by_tolerance(stand: &Stand, factors: &[f64]) -> anyhow::Result<Rows> {
    Ok(by_tolerance(stand, factors)?.into_iter().map(|[_, lost]| vec![lost]).collect())
}

fn by_jitter(stand: &Stand, jitters_px: &[f64]) -> anyhow::Result<Rows> {
    let scene = stand.upload(&poles(0.05))?;
    let camera =
        |x: f32| PinholeCamera::looking_at(Vec3::new(x, 0.0, 4.0), Vec3::NEG_Z * 2.0, Vec3::Y, 0.8, stand.sample_px);
    let texel_m = 6.0 / camera(0.0).focal_px.x;
    let mask = |method, jitter_px: f64| -> anyhow::Result<Vec<bool>> {
        let cameras = [camera(-0.4), camera(0.4 + jitter_px as f32 * texel_m)];
        let second = stand.sample(&scene, &cameras, method)?.remove(1);
        Ok(second.inverse_depth_per_m.iter().map(|&depth| depth > 0.0).collect())
    };
    rows(jitters_px, |jitter_px| {
        let mut flips = [0.0; 3];
        for (flips, method) in flips.iter_mut().zip(TESTS) {
            let (still, moved) = (mask(method, 0.0)?, mask(method, jitter_px)?);
            *flips = share(still.iter().zip(&moved).map(|(a, b)| a != b));
        }
        Ok(flips)
    })
}

/// Squares in front of each other, ten deep.
fn squares(count: u32) -> Scene {
    let mut scene = quad(Vec3::ZERO, 0.03, Vec3::new(0.2, 0.1, 1.0), [180, 90, 40]);
    let place = |i: u32| {
        // Spread over the field by a low-discrepancy sequence, so that few are in the field, too.
        let at = (glam::Vec2::new(0.754_877_7, 0.569_840_3) * i as f32).fract() * 5.0 - 2.5;
        at.extend(-0.5 * ((i * 7919) % 10) as f32)
    };
    let instance = |i| Instance { mesh: 0, world_from_mesh: Affine3A::from_translation(place(i)) };
    scene.instances = (0..count).map(instance).collect();
    scene
}

fn by_instances(stand: &Stand, counts: &[f64]) -> anyhow::Result<Rows> {
    let camera =
        |x: f32| PinholeCamera::looking_at(Vec3::new(x, 0.0, 4.0), Vec3::ZERO, Vec3::Y, 0.9, UVec2::splat(128));
    let cameras = [camera(-0.3), camera(0.3)];
    rows(counts, |count| {
        let scene = stand.upload(&squares(count as u32))?;
        let in_view = instances(&stand.sample(&scene, &cameras, SamplingMethod::CONVENTIONAL)?);
        let sampled = instances(&stand.sample(&scene, &cameras, TESTS[0])?);
        Ok([share(in_view.iter().map(|instance| sampled.contains(instance)))])
    })
}

fn instances(images: &[DepthImage]) -> std::collections::BTreeSet<u32> {
    let ids = images.iter().flat_map(|image| image.inverse_depth_per_m.iter().zip(image.surface_id.iter().flatten()));
    ids.filter(|(depth, _)| **depth > 0.0).map(|(_, id)| id.instance).collect()
}
