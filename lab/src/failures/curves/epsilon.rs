//! The ε of quadtrees of depths against planes: a sheet through a layered depth cube, by the host alone.

use depth_image::{Aabb, CubeGrid, LayeredDepthImage, Ray, oct8_from_unit, unit_from_oct8};
use glam::{Vec2, Vec3};
use reconstruction::scalar::CubeTwin;

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
/// Samples of a cube are those of the dominant axis.
const DOMINANT: f32 = 0.9;

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
    let bounds = Aabb { min: Vec3::ZERO, max: Vec3::splat((SIDE - 1) as f32) };
    let (grid, normals) = (CubeGrid::around(&bounds, SIDE)?, TILTS_DEG.map(normal));
    let of_planes = normals.map(|normal| {
        let twin = CubeTwin::new(&grid, &[0, 1, 2].map(|axis| sheet(&grid, axis, normal, DOMINANT)));
        rates(&bounds, normal, |ray| twin.walk(ray, 0.0).is_some())
    });
    let [planes_missed, planes_false] =
        [0, 1].map(|kind| of_planes.iter().map(|rates| rates[kind]).fold(0.0, f64::max));
    rows(factors, |factor| {
        let [low, middle, steep] = normals.map(|normal| {
            let image = sheet(&grid, 2, normal, 0.0);
            let pyramids = Pyramids::new(std::slice::from_ref(&image), factor as f32);
            rates(&bounds, normal, |ray| pyramids.trace(ray, 0.0).0.is_some())
        });
        Ok([low[0], middle[0], steep[0], low[1], middle[1], steep[1], planes_missed, planes_false])
    })
}

/// As samples hold it, so that the sheet has no other slope than they.
fn normal(tilt_deg: f32) -> Vec3 {
    let (sin, cos) = tilt_deg.to_radians().sin_cos();
    unit_from_oct8(oct8_from_unit((Vec2::from_angle(0.4) * sin).extend(cos)))
}

/// A sheet through the middle of the grid, on the lines of one axis; empty where the normal leans from the axis too far.
fn sheet(grid: &CubeGrid, axis: usize, normal: Vec3, least_of_greatest: f32) -> LayeredDepthImage {
    let (camera, middle) = (grid.camera(axis), Vec3::splat(0.5 * (SIDE - 1) as f32));
    let is_held = normal[axis].abs() >= least_of_greatest * normal.abs().max_element();
    let (mut first, mut planar_depth_m) = (vec![0], Vec::new());
    for place in (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| Vec2::new(x as f32, y as f32))) {
        let line = camera.ray(place + 0.5);
        let depth_m = normal.dot(middle - line.origin_in_world) / normal.dot(line.direction_in_world);
        planar_depth_m.extend(Some(depth_m).filter(|depth_m| is_held && (0.0..=camera.range_m).contains(depth_m)));
        first.push(planar_depth_m.len() as u32);
    }
    LayeredDepthImage {
        camera,
        first,
        plane_normal_oct8: vec![oct8_from_unit(normal); planar_depth_m.len()],
        color_rgb9e5: vec![0; planar_depth_m.len()],
        planar_depth_m,
        normal_oct16: None,
        specular: None,
        truncated: false,
    }
}

/// The shares of rays through the sheet that meet nothing, and of rays along it, in front of it, that meet something.
fn rates(bounds: &Aabb, normal: Vec3, is_met: impl Fn(Ray) -> bool) -> [f64; 2] {
    let (right, up) = normal.any_orthonormal_pair();
    let along = |turns: f32| {
        let at = Vec2::from_angle(turns * std::f32::consts::TAU);
        right * at.x + up * at.y
    };
    let ray = |number: usize, is_through: bool| {
        let [a, b, c, d] = [0.618_034, 0.754_878, 0.569_84, 0.819_173].map(|step| (step * number as f32).fract());
        let on_sheet = bounds.center() + along(a) * (6.0 * b.sqrt());
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
