//! A yard that no camera sees: a hole that is marked, or a wrong colour that is not.

use depth_image::{PinholeCamera, ProvenanceKind, View};
use glam::{Vec2, Vec3};
use scene::procedural::courtyard;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{depths, is_kind};
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Stage, looking, search};
use crate::failures::stand::Stand;

/// The height of the sample cameras' eyes, below the walls' tops.
const CAMERAS_M: f32 = 1.7;
/// The distance of all eyes from the middle of the yard.
const DISTANCE_M: f32 = 9.0;

pub const CURVE: Curve = Curve {
    name: "A yard that no camera sees",
    subject: "a courtyard, four images from below the walls' tops",
    x: X::linear("height of the view", "°", &[15.0, 30.0, 40.0, 50.0, 60.0, 75.0, 88.0])
        .with_small(&[15.0, 45.0, 60.0, 88.0]),
    y: ["share of the picture", ""],
    series: &[
        Series::new("the yard", &[Shape::rises(0.04, 0.005)]),
        Series::new("not marked, joint_carve", &[Shape::Bounded { least: 0.0, most: 0.02 }]),
        Series::new("not marked, light_field_search:64", &[Shape::rises(0.01, 0.01)]),
    ],
    why: "The carve marks what it does not know. The search meets the shadow volume that all cameras share, and calls its colour a hit.",
    measure,
};

fn measure(stand: &Stand, heights_deg: &[f64]) -> anyhow::Result<Rows> {
    let samples = [0.0f32, 0.4, 0.8, 1.2].map(|turn| {
        looking(Vec3::new(turn.cos() * DISTANCE_M, CAMERAS_M, turn.sin() * DISTANCE_M), Vec3::Y, 45.0, stand.sample_px)
    });
    let stage = Stage::new(stand, &courtyard(), &samples)?;
    rows(heights_deg, |height_deg| {
        let (sin, cos) = (height_deg as f32).to_radians().sin_cos();
        let turn = Vec2::from_angle(0.6) * cos * DISTANCE_M;
        let camera = looking(Vec3::new(turn.x, sin * DISTANCE_M, turn.y), Vec3::ZERO, 35.0, stand.view_px);
        let yard = yard(&camera, &stage.truth(&[camera])?[0]);
        let unmarked = |method| Ok::<_, anyhow::Error>(share_unmarked(&yard, &stage.views(&[camera], method)?[0]));
        let seen = yard.iter().filter(|is| **is).count() as f64 / yard.len() as f64;
        Ok([seen, unmarked(CARVE)?, unmarked(search(64))?])
    })
}

/// The pixels of the yard's floor and pillar: lower than the walls, inside them.
fn yard(camera: &PinholeCamera, truth: &View) -> Vec<bool> {
    let is_inside = |(index, depth): (usize, &f32)| {
        let width = camera.size_px.x as usize;
        let pixel = Vec2::new((index % width) as f32 + 0.5, (index / width) as f32 + 0.5);
        let point = camera.ray(pixel).at(depth.recip());
        *depth > 0.0 && point.x.abs() < 1.6 && point.z.abs() < 1.6 && point.y < 0.9
    };
    depths(truth).iter().enumerate().map(is_inside).collect()
}

/// Of all pixels, those of the yard that are not marked as filled, although no camera saw them.
fn share_unmarked(yard: &[bool], view: &View) -> f64 {
    let unmarked = yard.iter().zip(is_kind(view, ProvenanceKind::Filled)).filter(|(yard, filled)| **yard && !*filled);
    unmarked.count() as f64 / yard.len() as f64
}
