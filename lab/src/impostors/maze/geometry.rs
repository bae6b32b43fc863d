//! The geometry of a maze's camera: points there and back, and points beside faces.

use fixtures::Maze;
use glam::DVec3;
use rayon::prelude::*;
use report::{Bar, Check, Report};
use scene::procedural::parts::Rng;

use super::cameras;
use crate::failures::stage::looking;
use crate::graph::{GraphCamera, Layout, behind};

const POINTS: u64 = 1_000_000;
/// Points are drawn in streams of this many.
const STREAM: u64 = 10_000;
const OFF_FACE_M: f64 = 1e-6;

/// Adds the checks of 10⁶ points in all frusta.
///
/// # Errors
/// The camera's frusta cannot be used.
pub fn measure(maze: &Maze, report: &mut Report) -> anyhow::Result<()> {
    let view = looking(glam::Vec3::new(0.0, 1.6, 8.0), glam::Vec3::Y * 0.5, 45.0, cameras::NESTED_PX);
    let block = depth_image::Aabb::around([glam::Vec3::new(-0.5, 0.0, -0.5), glam::Vec3::new(0.5, 1.0, 0.5)]);
    let behind = GraphCamera::new(&behind(&view, &block, 0.3), &Layout::Nested)?;
    for (name, camera) in [("maze", cameras::nested(maze)?), ("behind a block", behind)] {
        let error_px = return_error_px(&camera);
        report.checks.push(Check::new(
            format!("{name}: error of points there and back"),
            error_px,
            "px",
            Bar::AtMost(0.01),
        ));
        let gap_px = gap_px(&camera);
        report.checks.push(Check::new(format!("{name}: points beside a face"), gap_px, "px", Bar::AtMost(0.02)));
    }
    let apart = return_error_px(&cameras::apart(maze)?);
    report.checks.push(Check::new("maze, apart: error of points there and back", apart, "px", Bar::AtMost(0.01)));
    Ok(())
}

/// The greatest distance between the places of a point and of what comes back from its place, rounded to `f32`.
fn return_error_px(camera: &GraphCamera) -> f64 {
    let corners: Vec<Vec<DVec3>> = camera.frusta.iter().map(crate::graph::Frustum::corners).collect();
    let streams = (0..POINTS / STREAM).into_par_iter().map(|stream| {
        let mut random = Rng::new(stream, 7);
        let errors = (0..STREAM).map(|number| {
            let point = between(&corners[number as usize % corners.len()], &mut random);
            let Some(place) = camera.project(point) else { return f64::INFINITY };
            let back = camera.project_in(place.frustum, camera.unproject(place).as_vec3().as_dvec3());
            back.pixel.distance(place.pixel)
        });
        errors.fold(0.0, f64::max)
    });
    streams.reduce(|| 0.0, f64::max)
}

/// The greatest distance between the places of two points on both sides of a face.
fn gap_px(camera: &GraphCamera) -> f64 {
    let mut random = Rng::new(1, 8);
    let mut greatest = 0.0;
    for (number, child) in camera.frusta.iter().enumerate().skip(1) {
        for _ in 0..STREAM {
            let point = between(&child.face, &mut random);
            let after = camera.project_in(number, point + child.entry.inwards * OFF_FACE_M);
            let parent = child.parent.unwrap_or_default();
            let before = camera.project_in(parent, point - child.entry.inwards * OFF_FACE_M);
            greatest = f64::max(greatest, before.pixel.distance(after.pixel));
        }
    }
    greatest
}

/// A random point between some others.
fn between(corners: &[DVec3], random: &mut Rng) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let mut shares = 0.0;
    for corner in corners {
        // Points come near to the corners, too.
        let share = -f64::from(random.unit().max(1e-7)).ln();
        sum += *corner * share;
        shares += share;
    }
    sum / shares
}
