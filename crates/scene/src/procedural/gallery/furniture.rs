//! A sofa, a table, shelves of books, plants, a rug and lanterns.

use std::f32::consts::TAU;

use glam::Vec3;

use super::super::parts::{MeshBuilder, Rng, Teapot, star, teapot, vertex};
use super::{HALF_LENGTH_M, HEIGHT_M};

const OAK: Vec3 = Vec3::new(168.0, 124.0, 82.0);
const DARK: Vec3 = Vec3::new(64.0, 56.0, 52.0);
const SOFA: Vec3 = Vec3::new(72.0, 98.0, 140.0);
const POTS: [Vec3; 2] = [Vec3::new(-5.3, 0.0, -3.2), Vec3::new(2.85, 0.0, -3.3)];
const LANTERNS: [(Vec3, f32); 3] =
    [(Vec3::new(-1.3, 2.75, 0.3), 0.3), (Vec3::new(-0.3, 3.05, 0.75), 0.24), (Vec3::new(-2.2, 3.0, 0.9), 0.22)];

pub(super) fn add(builder: &mut MeshBuilder) {
    add_rug(builder);
    add_sofa(builder);
    add_table(builder);
    add_shelf(builder);
    for foot in POTS {
        builder.drum(foot, [0.2, 0.28], 0.45, 32, Vec3::new(196.0, 178.0, 150.0));
    }
    for (middle, _) in LANTERNS {
        let [min, max] = [middle, Vec3::new(middle.x, HEIGHT_M, middle.z)];
        builder.cuboid(min - Vec3::new(0.006, 0.0, 0.006), max + Vec3::new(0.006, 0.0, 0.006), DARK);
    }
}

/// Rows and columns of knots in three colours.
fn add_rug(builder: &mut MeshBuilder) {
    let [columns, rows] = [72, 48];
    let side_m = 0.055;
    let colors = [Vec3::new(172.0, 52.0, 48.0), Vec3::new(222.0, 200.0, 160.0), Vec3::new(44.0, 58.0, 92.0)];
    for row in 0..rows {
        for column in 0..columns {
            let x = (2 * column + 1 - columns) as f32 * 0.5;
            let z = (2 * row + 1 - rows) as f32 * 0.5;
            let from_edge = (column.min(columns - 1 - column)).min(row.min(rows - 1 - row));
            let diamond = ((x.abs() * 0.5) as i32 + z.abs() as i32) / 4;
            let color = if from_edge < 3 { colors[1 + from_edge as usize % 2] } else { colors[diamond as usize % 3] };
            let middle = Vec3::new(-1.3 + x * side_m, 0.012, 0.6 + z * side_m);
            builder.rectangle(middle, Vec3::Z * (0.5 * side_m), Vec3::X * (0.5 * side_m), color);
        }
    }
}

fn add_sofa(builder: &mut MeshBuilder) {
    let middle = Vec3::new(-1.3, 0.0, 2.75);
    let mut part = |offset: Vec3, half: Vec3, color: Vec3| cushion(builder, middle + offset, half, color);
    part(Vec3::new(0.0, 0.25, 0.0), Vec3::new(1.3, 0.17, 0.48), SOFA);
    part(Vec3::new(0.0, 0.55, 0.42), Vec3::new(1.3, 0.42, 0.16), SOFA);
    for side in [-1.0, 1.0] {
        part(Vec3::new(1.25 * side, 0.4, 0.02), Vec3::new(0.16, 0.3, 0.5), SOFA);
        part(Vec3::new(0.58 * side, 0.47, -0.04), Vec3::new(0.54, 0.1, 0.44), SOFA * 1.1);
    }
    part(Vec3::new(-0.75, 0.68, 0.16), Vec3::new(0.24, 0.24, 0.09), Vec3::new(224.0, 164.0, 58.0));
    part(Vec3::new(0.8, 0.66, 0.18), Vec3::new(0.22, 0.22, 0.09), Vec3::new(206.0, 88.0, 70.0));
}

fn add_table(builder: &mut MeshBuilder) {
    let middle = Vec3::new(-1.3, 0.0, 0.6);
    builder.drum(middle + Vec3::Y * 0.36, [0.62, 0.62], 0.05, 64, OAK);
    for leg in 0..3 {
        let (sin, cos) = f32::sin_cos(TAU * leg as f32 / 3.0);
        builder.drum(middle + Vec3::new(0.42 * cos, 0.0, 0.42 * sin), [0.02, 0.035], 0.36, 16, OAK * 0.8);
    }
    teapot(builder, Teapot { foot: middle + Vec3::new(0.12, 0.41, 0.05), scale: 0.075, squares: 10 });
    for (x, z) in [(-0.3, 0.2), (-0.22, -0.22)] {
        let cup = middle + Vec3::new(x, 0.455, z);
        star(builder, [32, 16], Vec3::new(236.0, 232.0, 224.0), |out| cup + out * Vec3::new(0.06, 0.045, 0.06));
    }
}

/// Boards along the wall, with books of many colours that do not stand quite straight.
fn add_shelf(builder: &mut MeshBuilder) {
    let mut rng = Rng::new(23, 1);
    let [first, last] = [1.1, 3.6];
    let x = [-HALF_LENGTH_M, -HALF_LENGTH_M + 0.3];
    for board in 0..6 {
        let y = 0.2 + 0.42 * board as f32;
        builder.cuboid(Vec3::new(x[0], y, first), Vec3::new(x[1], y + 0.03, last), OAK * 0.7);
        let mut z = first + 0.04;
        while z < last - 0.1 && board < 5 {
            let [thick_m, high_m, deep_m] = [rng.between(0.018, 0.06), rng.between(0.2, 0.35), rng.between(0.18, 0.25)];
            let color = [
                Vec3::new(176.0, 60.0, 50.0),
                Vec3::new(58.0, 92.0, 130.0),
                Vec3::new(214.0, 190.0, 140.0),
                Vec3::new(70.0, 110.0, 78.0),
                Vec3::new(120.0, 70.0, 110.0),
                Vec3::new(230.0, 226.0, 214.0),
            ][(rng.unit() * 6.0) as usize];
            builder.cuboid(
                Vec3::new(x[0], y + 0.03, z),
                Vec3::new(x[0] + deep_m, y + 0.03 + high_m, z + thick_m),
                color * rng.between(0.8, 1.0),
            );
            z += thick_m + if rng.unit() < 0.06 { 0.12 } else { 0.004 };
        }
    }
    for z in [first, last] {
        builder.cuboid(Vec3::new(x[0], 0.0, z - 0.03), Vec3::new(x[1], 2.33, z), OAK * 0.7);
    }
}

/// Long leaves that bend over, out of pots.
pub(super) fn add_leaves(builder: &mut MeshBuilder) {
    let mut rng = Rng::new(5, 1);
    for foot in POTS {
        for _ in 0..70 {
            let (sin, cos) = f32::sin_cos(TAU * rng.unit());
            let out = Vec3::new(cos, 0.0, sin);
            let length_m = rng.between(0.7, 1.35);
            let lean = rng.between(0.15, 0.75);
            let color = Vec3::new(54.0, 110.0, 58.0) * rng.between(0.75, 1.25);
            add_leaf(builder, foot + Vec3::Y * 0.44 + out * 0.08, out * lean, length_m, color);
        }
    }
}

fn add_leaf(builder: &mut MeshBuilder, foot: Vec3, lean: Vec3, length_m: f32, color: Vec3) {
    const STEPS: u32 = 10;
    let side = lean.cross(Vec3::Y).normalize_or(Vec3::X);
    let first = builder.vertices.len() as u32;
    for step in 0..=STEPS {
        let t = step as f32 / STEPS as f32;
        let middle = foot + length_m * (lean * t + Vec3::Y * (t - 0.75 * lean.length() * t * t));
        let along = lean + Vec3::Y * (1.0 - 1.5 * lean.length() * t);
        let normal = side.cross(along).normalize_or(Vec3::Y);
        let half_m = 0.045 * (1.0 - t).powf(0.6) * (0.35 + 1.3 * t).min(1.0);
        for at in [middle - side * half_m, middle + side * half_m] {
            builder.push(vertex(at, normal, color));
        }
    }
    for step in 0..STEPS {
        let at = first + 2 * step;
        builder.quad([at, at + 1, at + 3, at + 2]);
    }
}

/// Paper balls that glow.
pub(super) fn add_lanterns(builder: &mut MeshBuilder) {
    for (middle, radius_m) in LANTERNS {
        star(builder, [48, 24], Vec3::splat(255.0), |out| middle + out * Vec3::new(1.0, 0.85, 1.0) * radius_m);
    }
}

/// A box with rounded edges, as of cloth.
fn cushion(builder: &mut MeshBuilder, middle: Vec3, half: Vec3, color_srgb: Vec3) {
    star(builder, [48, 24], color_srgb, |out| {
        middle + Vec3::from(out.to_array().map(|at| at.signum() * at.abs().powf(0.35))) * half
    });
}
