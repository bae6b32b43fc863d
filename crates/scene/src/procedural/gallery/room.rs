//! Floor, walls, windows and ceiling.

use glam::Vec3;

use super::super::geometry::MeshBuilder;
use super::super::random::Rng;

/// From the middle of the floor to the walls, and the height, in metres.
pub(super) const HALF_LENGTH_M: f32 = 6.0;
pub(super) const HALF_WIDTH_M: f32 = 4.0;
pub(super) const HEIGHT_M: f32 = 4.2;

const PLANK_M: [f32; 2] = [1.5, 0.2];
const WINDOW_MIDDLES_M: [f32; 4] = [-4.3, -1.45, 1.4, 4.25];
const HALF_WINDOW_M: f32 = 0.85;
const SILL_M: f32 = 0.75;
const LINTEL_M: f32 = 3.45;
const WALL_M: f32 = 0.35;

const PLASTER: Vec3 = Vec3::new(226.0, 220.0, 208.0);
const TERRACOTTA: Vec3 = Vec3::new(186.0, 88.0, 62.0);
const TEAL: Vec3 = Vec3::new(52.0, 116.0, 118.0);
const WOOD: Vec3 = Vec3::new(150.0, 104.0, 66.0);
const FRAME: Vec3 = Vec3::new(70.0, 62.0, 54.0);

pub(super) fn add(builder: &mut MeshBuilder) {
    add_floor(builder);
    let up = Vec3::Y * (0.5 * HEIGHT_M);
    let along = Vec3::X * HALF_LENGTH_M;
    let across = Vec3::Z * HALF_WIDTH_M;
    builder.rectangle(up * 2.0, along, across, PLASTER);
    builder.rectangle(up - along, -across, up, TERRACOTTA);
    builder.rectangle(up + along, across, up, TEAL);
    builder.rectangle(up + across, -along, up, PLASTER);
    add_windows(builder);
    for beam in 0..6 {
        let x = -5.0 + 2.0 * beam as f32;
        let min = Vec3::new(x - 0.1, HEIGHT_M - 0.28, -HALF_WIDTH_M);
        let max = Vec3::new(x + 0.1, HEIGHT_M, HALF_WIDTH_M);
        builder.cuboid(min, max, WOOD * 0.8);
    }
    add_skirting(builder);
}

/// Planks of unequal wood, with narrow joints.
fn add_floor(builder: &mut MeshBuilder) {
    let mut rng = Rng::new(11, 1);
    let [length_m, width_m] = PLANK_M;
    let rows = (2.0 * HALF_WIDTH_M / width_m) as i32;
    let columns = (2.0 * HALF_LENGTH_M / length_m) as i32 + 1;
    builder.rectangle(Vec3::Y * -0.004, Vec3::Z * HALF_WIDTH_M, Vec3::X * HALF_LENGTH_M, WOOD * 0.3);
    for row in 0..rows {
        let shift_m = rng.unit() * length_m;
        for column in 0..=columns {
            let start_m = -HALF_LENGTH_M - shift_m + column as f32 * length_m;
            let [first, last] = [start_m, start_m + length_m - 0.006].map(|x| x.clamp(-HALF_LENGTH_M, HALF_LENGTH_M));
            if last - first < 0.01 {
                continue;
            }
            let z = -HALF_WIDTH_M + (row as f32 + 0.5) * width_m;
            let color = WOOD * rng.between(0.82, 1.12) + Vec3::new(rng.between(-6.0, 8.0), 0.0, 0.0);
            let middle = Vec3::new(0.5 * (first + last), 0.0, z);
            builder.rectangle(middle, Vec3::Z * (0.5 * width_m - 0.003), Vec3::X * (0.5 * (last - first)), color);
        }
    }
}

/// The wall with windows is as thick as their reveals.
fn add_windows(builder: &mut MeshBuilder) {
    let [inner, outer] = [-HALF_WIDTH_M, -HALF_WIDTH_M - WALL_M];
    let mut block = |x: [f32; 2], y: [f32; 2]| {
        builder.cuboid(Vec3::new(x[0], y[0], outer), Vec3::new(x[1], y[1], inner), PLASTER);
    };
    block([-HALF_LENGTH_M, HALF_LENGTH_M], [-0.01, SILL_M]);
    block([-HALF_LENGTH_M, HALF_LENGTH_M], [LINTEL_M, HEIGHT_M]);
    let mut last = -HALF_LENGTH_M;
    for middle in WINDOW_MIDDLES_M {
        block([last, middle - HALF_WINDOW_M], [SILL_M, LINTEL_M]);
        last = middle + HALF_WINDOW_M;
    }
    block([last, HALF_LENGTH_M], [SILL_M, LINTEL_M]);
    for middle in WINDOW_MIDDLES_M {
        add_frame(builder, middle);
    }
}

/// Bars of a window, and the board below it.
fn add_frame(builder: &mut MeshBuilder, middle: f32) {
    let z = [-HALF_WIDTH_M - 0.22, -HALF_WIDTH_M - 0.15];
    let mut bar = |x: [f32; 2], y: [f32; 2]| {
        builder.cuboid(Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]), FRAME);
    };
    let left = middle - HALF_WINDOW_M;
    let right = middle + HALF_WINDOW_M;
    for x in [left, middle - 0.03, right - 0.06] {
        bar([x, x + 0.06], [SILL_M, LINTEL_M]);
    }
    for y in [SILL_M, 0.5 * (SILL_M + LINTEL_M) + 0.3, LINTEL_M - 0.06] {
        bar([left, right], [y, y + 0.06]);
    }
    let board = [
        Vec3::new(left - 0.08, SILL_M, -HALF_WIDTH_M - 0.12),
        Vec3::new(right + 0.08, SILL_M + 0.05, 0.16 - HALF_WIDTH_M),
    ];
    builder.cuboid(board[0], board[1], WOOD);
}

fn add_skirting(builder: &mut MeshBuilder) {
    let x = HALF_LENGTH_M;
    let z = HALF_WIDTH_M;
    for [min, max] in [
        [Vec3::new(-x, 0.0, -z), Vec3::new(x, 0.14, 0.025 - z)],
        [Vec3::new(-x, 0.0, z - 0.025), Vec3::new(x, 0.14, z)],
        [Vec3::new(-x, 0.0, -z), Vec3::new(0.025 - x, 0.14, z)],
        [Vec3::new(x - 0.025, 0.0, -z), Vec3::new(x, 0.14, z)],
    ] {
        builder.cuboid(min, max, FRAME);
    }
}
