//! Pictures on the walls, and sculptures.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::super::parts::{MeshBuilder, Noise, Station, mix, star, vertex};
use super::{HALF_LENGTH_M, HALF_WIDTH_M};

const PLINTH: Vec3 = Vec3::new(214.0, 210.0, 202.0);

/// A picture: its middle, half its width to the right as seen, half its height, and its colours.
struct Picture {
    middle: Vec3,
    right: Vec3,
    half_height_m: f32,
    seed: u64,
    colors: [Vec3; 3],
}

pub(super) fn add(builder: &mut MeshBuilder) {
    let [ink, sand, sky] = [Vec3::new(30.0, 40.0, 62.0), Vec3::new(232.0, 206.0, 160.0), Vec3::new(96.0, 160.0, 206.0)];
    let [rust, leaf, gold] =
        [Vec3::new(190.0, 70.0, 40.0), Vec3::new(60.0, 120.0, 84.0), Vec3::new(236.0, 180.0, 70.0)];
    let on_left_wall = Vec3::new(0.02 - HALF_LENGTH_M, 1.95, -0.75);
    let colors = [ink, sky, sand];
    let right = Vec3::NEG_Z * 1.05;
    add_picture(builder, &Picture { middle: on_left_wall, right, half_height_m: 0.75, seed: 3, colors });
    for (x, half_width_m, seed, colors) in
        [(-4.2, 0.5, 8, [rust, gold, sand]), (1.2, 0.8, 13, [ink, rust, gold]), (3.9, 0.6, 21, [leaf, sand, sky])]
    {
        let middle = Vec3::new(x, 1.9, HALF_WIDTH_M - 0.02);
        add_picture(builder, &Picture { middle, right: Vec3::NEG_X * half_width_m, half_height_m: 0.6, seed, colors });
    }
    builder.cuboid(Vec3::new(-3.85, 0.0, -2.35), Vec3::new(-3.35, 1.0, -1.85), PLINTH);
    add_knot(builder, Vec3::new(-3.6, 1.47, -2.1), 0.17, Vec3::new(214.0, 158.0, 66.0));
    builder.cuboid(Vec3::new(0.9, 0.0, -2.6), Vec3::new(1.5, 0.75, -2.0), PLINTH);
    let noise = Noise::new(14);
    let stone = Vec3::new(206.0, 204.0, 198.0);
    star(builder, [128, 64], stone, |out| {
        Vec3::new(1.2, 1.2, -2.3) + out * Vec3::new(0.3, 0.45, 0.26) * (1.0 + 0.22 * noise.in_space(out * 1.6 + 0.4))
    });
    builder.cuboid(Vec3::new(4.7, 0.0, -1.5), Vec3::new(5.2, 0.9, -1.0), PLINTH);
    star(builder, [96, 48], Vec3::new(120.0, 40.0, 44.0), |out| {
        let waist = 0.6 + 0.4 * (4.0 * out.y).cos().abs();
        Vec3::new(4.95, 1.28, -1.25) + out * Vec3::new(0.2 * waist, 0.38, 0.2 * waist)
    });
}

/// A canvas of smooth colours in a dark frame.
fn add_picture(builder: &mut MeshBuilder, picture: &Picture) {
    const CELLS: [i32; 2] = [56, 40];
    let &Picture { middle, right, half_height_m, seed, colors } = picture;
    let up = Vec3::Y * half_height_m;
    let noise = Noise::new(seed);
    let normal = right.cross(up).normalize_or(Vec3::Z);
    for row in 0..CELLS[1] {
        for column in 0..CELLS[0] {
            let x = (2 * column + 1 - CELLS[0]) as f32 / CELLS[0] as f32;
            let y = (2 * row + 1 - CELLS[1]) as f32 / CELLS[1] as f32;
            let at = Vec2::new(x * right.length(), y * half_height_m);
            let bend = noise.at(at * 1.3);
            let high = (0.5 + 0.5 * (y + 0.9 * bend)).clamp(0.0, 1.0);
            let band = (0.5 + 0.8 * noise.at(at * 2.9 + bend * 2.0)).clamp(0.0, 1.0);
            let color = mix(mix(colors[0], colors[1], high), colors[2], band * band);
            let cell = middle + normal * 0.01 + right * x + up * y;
            builder.rectangle(cell, right / CELLS[0] as f32, up / CELLS[1] as f32, color);
        }
    }
    let dark = Vec3::new(40.0, 34.0, 30.0);
    let out = right * (1.0 + 0.03 / right.length());
    let over = up * (1.0 + 0.03 / half_height_m);
    for [from, to] in
        [[-out - over, out - over], [-out + over, out + over], [-out - over, over - out], [out - over, out + over]]
    {
        let stations = [from, to].map(|corner| Station { middle: middle + corner + normal * 0.01, up: normal });
        builder.beam(&stations, 0.06, 0.06, dark);
    }
}

/// A tube along a knot that winds twice around one axis and three times around the other.
fn add_knot(builder: &mut MeshBuilder, middle: Vec3, scale_m: f32, color: Vec3) {
    add_tube(builder, 320, 20, 0.42 * scale_m, color, |t| {
        let ring = TAU * 2.0 * t;
        let wind = TAU * 3.0 * t;
        let radius = 1.6 + 0.7 * wind.cos();
        middle + scale_m * Vec3::new(radius * ring.cos(), 0.9 * wind.sin() + 0.3, radius * ring.sin())
    });
}

/// A ring of light on the wall.
pub(super) fn add_ring(builder: &mut MeshBuilder) {
    let middle = Vec3::new(HALF_LENGTH_M - 0.12, 2.0, 0.9);
    add_tube(builder, 128, 12, 0.06, Vec3::splat(255.0), |t| {
        let (sin, cos) = f32::sin_cos(TAU * t);
        middle + Vec3::new(0.0, 0.75 * sin, 0.75 * cos)
    });
}

/// A closed tube around `at`, whose parameter runs from 0 to 1.
fn add_tube(
    builder: &mut MeshBuilder,
    stations: u32,
    sides: u32,
    radius_m: f32,
    color: Vec3,
    at: impl Fn(f32) -> Vec3,
) {
    let first = builder.vertices.len() as u32;
    for station in 0..stations {
        let t = station as f32 / stations as f32;
        let along = (at(t + 1e-3) - at(t - 1e-3)).normalize_or(Vec3::X);
        let up = (Vec3::Y - along * along.y).normalize_or(along.any_orthonormal_vector());
        let side = along.cross(up);
        for number in 0..sides {
            let (sin, cos) = f32::sin_cos(TAU * number as f32 / sides as f32);
            let normal = side * cos + up * sin;
            builder.push(vertex(at(t) + normal * radius_m, normal, color));
        }
    }
    builder.join_rings(first, stations, sides, true);
}
