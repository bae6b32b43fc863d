//! Surfaces that a ray passes or meets by chance: thin poles, far walls, eyes at odd places.

use depth_image::{PinholeCamera, ProvenanceKind, View};
use fixtures::{poles, quad};
use glam::Vec3;
use reconstruction::ReconstructionMethod;
use scene::procedural::tree_terrain;

use crate::failures::curve::{Curve, FLIP, Rows, Series, X, rows};
use crate::failures::measures::{depths, foreground, is_kind, share, share_of_kind};
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, HYBRID, MESH, POLES, Stage, TREE, looking, search};
use crate::failures::stand::Stand;

const WIDE_TREE: Cell = Cell { half_m: 0.4, ..TREE };
/// The distance of the poles, and one between them and the wall.
const POLES_M: f32 = 5.0;
const BETWEEN_M: f32 = 6.0;
/// The radius of poles that are some texels wide.
const RADIUS_M: f32 = 0.12;
const POLES_SUBJECT: &str = "nine poles before a wall, four images";
const TREE_SUBJECT: &str = "a tree over a terrain, four images from above";
const FINITE: &[Shape] = &[Shape::Bounded { least: 0.0, most: 1.0 }];
const ALL_METHODS: &[Series] = &[
    Series::new("joint_carve", FINITE),
    Series::new("light_field_search:64", FINITE),
    Series::new("mesh", FINITE),
    Series::new("hybrid_mesh", FINITE),
];

pub const CURVES: [Curve; 6] = [
    Curve {
        name: "Poles found against their radius",
        subject: POLES_SUBJECT,
        x: X::log("radius", "texels", &[0.15, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0]).with_small(&[0.3, 0.6, 1.0, 2.0, 3.0]),
        y: ["pixels of poles found", ""],
        series: &[
            Series::new("light_field_search:8", &[Shape::rises(0.2, 0.12)]),
            Series::new("light_field_search:64", &[Shape::rises(0.1, 0.12)]),
            Series::new("joint_carve", &[Shape::rises(0.1, 0.12), Shape::EqualAt { x: 3.0, y: 0.95, tolerance: 0.05 }]),
        ],
        why: "A step longer than a pole is thick enters it by chance; the carve steps from texel to texel.",
        measure: by_radius,
    },
    Curve {
        name: "Picture error against steps",
        subject: POLES_SUBJECT,
        x: X::log("steps", "", &[2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0, 1024.0])
            .with_small(&[2.0, 4.0, 8.0, 16.0, 64.0, 256.0, 512.0, 1024.0]),
        y: FLIP,
        series: &[Series::new("light_field_search", &[Shape::FallsThenFlat { least_fall: 0.02, tolerance: 0.015 }])],
        why: "Few steps lose poles; the error that stays is that of texels.",
        measure: by_steps,
    },
    Curve {
        name: "Picture error against the stop level",
        subject: POLES_SUBJECT,
        x: X::linear("level", "", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).with_small(&[0.0, 1.0, 2.0, 3.0, 4.0]),
        y: FLIP,
        series: &[Series::new("joint_carve", &[Shape::rises(0.02, 0.01)])],
        why: "The nearest thing in a node of 2ⁿ × 2ⁿ cells counts as the surface: silhouettes grow by as much.",
        measure: by_stop_level,
    },
    Curve {
        name: "A far wall found beside a near card",
        subject: "a card at 1 m before a wall, two images",
        x: X::log("far / near", "", &[1e1, 1e2, 1e3, 1e4, 1e5]),
        y: ["pixels with a surface", ""],
        series: &[Series::new(
            "joint_carve",
            &[Shape::falls(0.3, 0.02), Shape::EqualAt { x: 1e2, y: 1.0, tolerance: 0.05 }],
        )],
        why: "Where half a code at the far wall is longer than a surface is thick, two footprints, the ray passes the wall: from 131,000 over the focal length in texels on.",
        measure: by_range,
    },
    Curve {
        name: "Eye above, in and below the volume",
        subject: TREE_SUBJECT,
        x: X::linear("height of the eye", "heights of the volume", &[-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0])
            .with_small(&[-1.0, 0.0, 0.5, 1.0, 2.0]),
        y: FLIP,
        series: ALL_METHODS,
        why: "Rays begin before, in or behind the volume; surfaces are seen from below, where no camera was.",
        measure: by_height,
    },
    Curve {
        name: "Rays along the volume's upper face",
        subject: TREE_SUBJECT,
        x: X::linear("pitch", "°", &[-2.0, -0.5, -0.01, 0.0, 0.01, 0.5, 2.0]).with_small(&[-0.5, 0.0, 0.5]),
        y: FLIP,
        series: ALL_METHODS,
        why: "A ray in the plane of a face divides by zero where it enters and leaves.",
        measure: by_pitch,
    },
];

fn by_radius(stand: &Stand, radii_px: &[f64]) -> anyhow::Result<Rows> {
    let samples = POLES.samples(4, stand.sample_px);
    let texel_m = POLES_M / samples[0].focal_px.x;
    let cameras = POLES.views(stand.view_px);
    rows(radii_px, |radius_px| {
        let stage = Stage::new(stand, &poles(radius_px as f32 * texel_m), &samples)?;
        let truths = stage.truth(&cameras)?;
        let mut recalls = [0.0; 3];
        for (recall, method) in recalls.iter_mut().zip([search(8), search(64), CARVE]) {
            *recall = recall_of_poles(&truths, &stage.views(&cameras, method)?);
        }
        Ok(recalls)
    })
}

/// The share of the poles' pixels at which a view has a hit about as near.
fn recall_of_poles(truths: &[View], views: &[View]) -> f64 {
    share(truths.iter().zip(views).flat_map(|(truth, view)| {
        let pixels = depths(truth).iter().zip(depths(view)).zip(is_kind(view, ProvenanceKind::Hit));
        pixels.filter(|((truth, _), _)| is_pole(**truth)).map(|((_, found), hit)| hit && is_pole(*found))
    }))
}

fn is_pole(inverse_depth_per_m: f32) -> bool {
    inverse_depth_per_m > BETWEEN_M.recip()
}

fn stage_of_poles(stand: &Stand) -> anyhow::Result<Stage<'_>> {
    Stage::new(stand, &poles(RADIUS_M), &POLES.samples(4, stand.sample_px))
}

fn by_steps(stand: &Stand, steps: &[f64]) -> anyhow::Result<Rows> {
    let stage = stage_of_poles(stand)?;
    rows(steps, |steps| stage.flips(&POLES.views(stand.view_px), [search(steps as u32)]))
}

fn by_stop_level(stand: &Stand, levels: &[f64]) -> anyhow::Result<Rows> {
    let stage = stage_of_poles(stand)?;
    rows(levels, |level| {
        let method = ReconstructionMethod::JointCarve { stop_level: level as u32 };
        stage.flips(&POLES.views(stand.view_px), [method])
    })
}

fn by_range(stand: &Stand, ratios: &[f64]) -> anyhow::Result<Rows> {
    rows(ratios, |far_m| {
        let far_m = far_m as f32;
        let mut scene = quad(Vec3::NEG_Z * far_m, far_m, Vec3::Z, [180, 90, 40]);
        let near = quad(Vec3::new(-0.6, 0.0, -1.0), 0.3, Vec3::Z, [40, 90, 180]);
        scene.instances.push(scene::Instance { mesh: 1, ..near.instances[0] });
        scene.meshes.extend(near.meshes);
        let places = [(-0.1, stand.sample_px), (0.1, stand.sample_px), (0.02, stand.view_px)];
        let [left, right, view] =
            places.map(|(x, size_px)| looking(Vec3::X * x, Vec3::new(x, 0.0, -1.0), 60.0, size_px));
        let stage = Stage::new(stand, &scene, &[left, right])?;
        Ok([share_of_kind(&stage.views(&[view], CARVE)?, ProvenanceKind::Hit)])
    })
}

fn by_height(stand: &Stand, heights: &[f64]) -> anyhow::Result<Rows> {
    errors_from(stand, heights, |stage, height| {
        let volume = stage.volume;
        let y = volume.min.y + height * volume.size().y;
        looking(volume.center().with_y(y) + Vec3::X * 0.01, volume.center(), 60.0, stand.view_px)
    })
}

fn by_pitch(stand: &Stand, pitches_deg: &[f64]) -> anyhow::Result<Rows> {
    errors_from(stand, pitches_deg, |stage, pitch_deg| {
        let volume = stage.volume;
        let eye = volume.center().with_y(volume.max.y) + Vec3::Z * 1.5 * volume.size().z;
        let towards = Vec3::new(0.0, pitch_deg.to_radians().sin(), -pitch_deg.to_radians().cos());
        looking(eye, eye + towards, 45.0, stand.view_px)
    })
}

/// The error of each method, for a view at each x.
fn errors_from(stand: &Stand, x: &[f64], camera: impl Fn(&Stage<'_>, f32) -> PinholeCamera) -> anyhow::Result<Rows> {
    let stage = Stage::with_corners(stand, &tree_terrain(2000, 1), &WIDE_TREE.samples(4, stand.sample_px))?;
    let cameras: Vec<PinholeCamera> = x.iter().map(|&x| camera(&stage, x as f32)).collect();
    let truths = stage.truth(&cameras)?;
    let views = [CARVE, search(64), MESH, HYBRID].map(|method| stage.views(&cameras, method));
    let views = views.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let rows = (0..x.len()).map(|place| {
        let one = place..=place;
        views.iter().map(|views| Ok(foreground(&truths[one.clone()], &views[one.clone()])?.flip)).collect()
    });
    rows.collect()
}
