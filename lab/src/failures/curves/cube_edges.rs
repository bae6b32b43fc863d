//! Edges in layered depth cubes: where two images meet, and walls that are turned against the lines. By the host alone.

use depth_image::{CubeGrid, Ray};
use glam::{Quat, Vec3};

use crate::failures::cubes::{self, Crossing, met_wrongly, missed, noise};
use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;

/// Lines along an edge of the cube.
const SIDE: u32 = 24;
const RAYS: u32 = 2000;
const BOXES: u32 = 8;
/// The box's faces on the far side of its edge.
const BACK_M: f32 = 4.0;
/// The last line before the edge.
const LINE_M: f32 = 14.0;

const FLAT: &[Shape] = &[Shape::Bounded { least: 0.0, most: 0.05 }, Shape::Plateau { tolerance: 0.02 }];

pub const CURVES: [Curve; 2] = [
    Curve {
        name: "Rays through an edge between two images",
        subject: "an upright edge of 90° of a box, whose sides are on lines of two axes, the twin",
        x: X::linear(
            "the edge behind the last lines",
            "spacings",
            &[0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.98],
        ),
        y: ["rays within a spacing of the edge", ""],
        series: &[
            Series::new("onto it, missed", &[Shape::rises(0.15, 0.01)]),
            Series::new("past it, that hit", &[Shape::falls(0.15, 0.01)]),
        ],
        why: "Squares of both images reach 0.55 spacings beyond their last line: over the edge, or not as far as it.",
        measure: by_place,
    },
    Curve {
        name: "Rays against a cube turned from the walls",
        subject: "boxes in a cube that is turned around the upright axis, the twin",
        x: X::linear("angle of lines and walls", "°", &[0.0, 5.0, 15.0, 25.0, 35.0, 45.0]),
        y: ["rays around the boxes", ""],
        series: &[Series::new("missed", FLAT), Series::new("false", FLAT)],
        why: "Walls are met as planes at every angle; their squares end up to half a spacing off an edge, whatever the angle.",
        measure: by_turn,
    },
];

/// Where a ray crosses the faces of a box.
fn box_crossings(ray: Ray, min: Vec3, max: Vec3) -> Vec<Crossing> {
    let face = |number: usize| {
        let (axis, is_max) = (number / 2, number % 2 == 1);
        let at = if is_max { max[axis] } else { min[axis] };
        let t = (at - ray.origin_in_world[axis]) / ray.direction_in_world[axis];
        let point = ray.origin_in_world + ray.direction_in_world * t;
        let is_within = (0..3).all(|other| other == axis || (min[other]..=max[other]).contains(&point[other]));
        let normal_in_world = Vec3::AXES[axis] * if is_max { 1.0 } else { -1.0 };
        (t.is_finite() && is_within).then_some(Crossing { t, normal_in_world })
    };
    (0..6).filter_map(face).collect()
}

fn by_place(_: &Stand, places: &[f64]) -> anyhow::Result<Rows> {
    let grid = cubes::grid(SIDE)?;
    rows(places, |place| {
        let edge_m = LINE_M + place as f32;
        let (min, max) = (Vec3::new(BACK_M, -1e3, BACK_M), Vec3::new(edge_m, 1e3, edge_m));
        let crossings = |ray| box_crossings(ray, min, max);
        let twin = cubes::cube(&grid, crossings);
        let near_edge = |from: Vec3, least_aside: f32, seed: u32| {
            let [turn, up, aside, height] = noise(seed);
            let from = Quat::from_rotation_y(0.8 * (turn - 0.5)) * (from + Vec3::Y * (up - 0.5));
            let across = Vec3::Y.cross(from).normalize_or(Vec3::X) * (least_aside + (1.0 - least_aside) * aside);
            let edge = Vec3::new(edge_m, 8.0 + 8.0 * height, edge_m);
            cubes::both(&twin, crossings, cubes::ray_to(edge + across, from))
        };
        let onto = (0..RAYS).map(|seed| near_edge(Vec3::new(1.0, 0.0, 1.0), -1.0, seed));
        let past = (0..RAYS).map(|seed| near_edge(Vec3::new(-1.0, 0.0, 1.0), 0.0, seed));
        Ok([missed(onto), met_wrongly(past)])
    })
}

fn by_turn(_: &Stand, angles_deg: &[f64]) -> anyhow::Result<Rows> {
    let (straight, middle) = (cubes::grid(SIDE)?, Vec3::splat(0.5 * (SIDE - 1) as f32));
    rows(angles_deg, |angle_deg| {
        let grid = turned(&straight, middle, angle_deg as f32);
        let met: Vec<_> = (0..BOXES)
            .flat_map(|number| {
                let half_m = 4.0 + 2.0 * Vec3::from(noise(number));
                let middle = middle + Vec3::from(noise(number + BOXES));
                let crossings = move |ray| box_crossings(ray, middle - half_m, middle + half_m);
                let twin = cubes::cube(&grid, crossings);
                let rays = cubes::rays_around(middle, half_m.length(), RAYS);
                rays.map(|ray| cubes::both(&twin, crossings, ray)).collect::<Vec<_>>()
            })
            .collect();
        Ok([missed(met.iter().copied()), met_wrongly(met)])
    })
}

/// Around the upright axis through the middle.
fn turned(straight: &CubeGrid, middle: Vec3, angle_deg: f32) -> CubeGrid {
    let world_from_cube = Quat::from_rotation_y(angle_deg.to_radians());
    let corner_in_world = middle + world_from_cube * (straight.corner_in_world - middle);
    CubeGrid { world_from_cube, corner_in_world, ..*straight }
}
