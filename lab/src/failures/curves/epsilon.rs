//! The ε of quadtrees of depths against planes: a sheet through a layered depth cube, by the host alone.

use depth_image::{Ray, oct8_from_unit, unit_from_oct8};
use glam::{Vec2, Vec3};

use crate::failures::cubes::{self, Crossing};
use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::share;
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;
use crate::layered::pyramid::Pyramids;

/// Angles between the sheet's normal and the lines of the one image.
const TILTS_DEG: [f32; 3] = [30.0, 60.0, 80.0];
/// Lines along an edge; the spacing is 1 m.
const SIDE: u32 = 24;
const RAYS: usize = 400;
/// Rays along the sheet sink by this share of their way, so that its front faces them.
const SINKING: f32 = 0.02;

const NONE: &[Shape] = &[Shape::EqualAt { x: 1.0, y: 0.0, tolerance: 0.0 }];

pub const CURVE: Curve = Curve {
    name: "Rays missed and false hits against the multiplier of ε",
    subject: "a sheet, one layered image with quadtrees, and the planes of a cube's samples",
    x: X::log("ε over half a texel at the sheet's slope", "", &[0.25, 0.5, 0.71, 1.0, 1.41, 2.0, 4.0]),
    y: ["rays through the sheet missed, rays past it that hit", ""],
    series: &[
        Series::new("missed, 30°", &[Shape::falls(0.05, 0.0)]),
        Series::new("missed, 60°", &[Shape::falls(0.05, 0.0)]),
        Series::new("missed, 80°", &[Shape::falls(0.05, 0.0)]),
        Series::new("false, 30°", &[Shape::rises(0.2, 0.0)]),
        Series::new("false, 60°", &[Shape::rises(0.2, 0.0)]),
        Series::new("false, 80°", &[Shape::rises(0.2, 0.0)]),
        Series::new("planes: missed", NONE),
        Series::new("planes: false", NONE),
    ],
    why: "One ε for all rays is too small where they cross steeply and too large where they pass along. A plane has neither fault.",
    measure,
};

fn measure(_: &Stand, factors: &[f64]) -> anyhow::Result<Rows> {
    let (grid, normals) = (cubes::grid(SIDE)?, TILTS_DEG.map(normal));
    let of_planes = normals.map(|normal| {
        let twin = cubes::cube(&grid, sheet(normal));
        rates(normal, |ray| twin.walk(ray, 0.0).is_some())
    });
    let [planes_missed, planes_false] =
        [0, 1].map(|kind| of_planes.iter().map(|rates| rates[kind]).fold(0.0, f64::max));
    rows(factors, |factor| {
        let [low, middle, steep] = normals.map(|normal| {
            let image = cubes::image(&grid, 2, 0.0, sheet(normal));
            let pyramids = Pyramids::new(std::slice::from_ref(&image), factor as f32);
            rates(normal, |ray| pyramids.trace(ray, 0.0).0.is_some())
        });
        Ok([low[0], middle[0], steep[0], low[1], middle[1], steep[1], planes_missed, planes_false])
    })
}

/// As samples hold it, so that the sheet has no other slope than they.
fn normal(tilt_deg: f32) -> Vec3 {
    let (sin, cos) = tilt_deg.to_radians().sin_cos();
    unit_from_oct8(oct8_from_unit((Vec2::from_angle(0.4) * sin).extend(cos)))
}

/// Where a ray crosses a sheet through the middle of the grid.
fn sheet(normal: Vec3) -> impl Fn(Ray) -> Vec<Crossing> {
    let middle = Vec3::splat(0.5 * (SIDE - 1) as f32);
    move |ray| {
        let t = normal.dot(middle - ray.origin_in_world) / normal.dot(ray.direction_in_world);
        vec![Crossing { t, normal_in_world: normal }]
    }
}

/// The shares of rays through the sheet that meet nothing, and of rays along it, in front of it, that meet something.
fn rates(normal: Vec3, is_met: impl Fn(Ray) -> bool) -> [f64; 2] {
    let (right, up) = normal.any_orthonormal_pair();
    let along = |turns: f32| {
        let at = Vec2::from_angle(turns * std::f32::consts::TAU);
        right * at.x + up * at.y
    };
    let ray = |number: usize, is_through: bool| {
        let [a, b, c, d] = [0.618_034, 0.754_878, 0.569_84, 0.819_173].map(|step| (step * number as f32).fract());
        let on_sheet = Vec3::splat(0.5 * (SIDE - 1) as f32) + along(a) * (6.0 * b.sqrt());
        let (back, height_m) = match is_through {
            true => ((along(c) + normal * (0.2 + 4.0 * d)).normalize_or_zero(), 0.0),
            // At most 42 m within the cube: a ray never reaches the sheet.
            false => (along(c) + normal * SINKING, 0.6 + 2.0 * d),
        };
        let origin_in_world = on_sheet + normal * height_m + back * 15.0;
        Ray { origin_in_world, direction_in_world: -back }
    };
    let [missed, wrong] = [true, false].map(|is_through| (0..RAYS).map(move |number| (number, is_through)));
    let met = |(number, is_through)| is_met(ray(number, is_through));
    [share(missed.map(|which| !met(which))), share(wrong.map(met))]
}
