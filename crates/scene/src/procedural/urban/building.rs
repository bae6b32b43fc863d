//! Buildings: walls with recessed windows, ledges, and roofs with parapets and fittings.

use glam::{Vec2, Vec3};

use super::super::geometry::MeshBuilder;
use super::super::random::Rng;
use super::at_height;
use super::street::KERB_M;

const RECESS_M: f32 = 0.6;
/// Approximate number of windows of a building: those of a higher one are wider.
const WINDOWS: f32 = 45.0;

const WALLS_SRGB: [[f32; 3]; 6] = [
    [196.0, 178.0, 152.0],
    [168.0, 104.0, 84.0],
    [206.0, 204.0, 196.0],
    [142.0, 146.0, 150.0],
    [186.0, 156.0, 116.0],
    [120.0, 110.0, 104.0],
];

/// A building on a quarter of a block, `half_m` to each side of `middle`.
pub(super) fn add(builder: &mut MeshBuilder, middle: Vec2, half_m: f32, is_central: bool, rng: &mut Rng) {
    let half = Vec2::new(half_m - rng.between(1.0, 7.0), half_m - rng.between(1.0, 7.0));
    let height_m = if is_central { rng.between(34.0, 78.0) } else { rng.between(12.0, 36.0) };
    let wall = Vec3::from(WALLS_SRGB[(rng.unit() * WALLS_SRGB.len() as f32) as usize]) * rng.between(0.9, 1.06);
    let top_m = KERB_M + height_m;
    if height_m < 40.0 {
        let foot = at_height(middle - half, KERB_M);
        add_body(builder, foot, at_height(middle + half, top_m), WINDOWS, wall, rng);
        add_roof_details(builder, middle, half, top_m, rng);
        return;
    }
    // A tower over a broader base.
    let base_top_m = KERB_M + rng.between(9.0, 14.0);
    let slim = half * rng.between(0.58, 0.74);
    let foot = at_height(middle - half, KERB_M);
    add_body(builder, foot, at_height(middle + half, base_top_m), 0.35 * WINDOWS, wall * 0.92, rng);
    let foot = at_height(middle - slim, base_top_m);
    add_body(builder, foot, at_height(middle + slim, top_m), 0.8 * WINDOWS, wall, rng);
    add_roof_details(builder, middle, slim, top_m, rng);
}

/// Walls, a roof within a parapet, and a ledge over the ground floor.
fn add_body(builder: &mut MeshBuilder, min: Vec3, max: Vec3, windows: f32, color_srgb: Vec3, rng: &mut Rng) {
    let size = max - min;
    let rows = (size.y / rng.between(3.8, 5.2)).round().max(2.0);
    let columns = (windows / rows / 4.0).max(1.0);
    // Columns are as wide on all four sides.
    let share = 2.0 / (size.x + size.z);
    let columns = [size.x * share, size.z * share].map(|side| (columns * side).round().max(1.0) as u32);
    // Each from its lower left corner to the right.
    let walls = [
        (Vec3::new(min.x, min.y, max.z), Vec3::X * (max.x - min.x), columns[0]),
        (Vec3::new(max.x, min.y, max.z), Vec3::NEG_Z * (max.z - min.z), columns[1]),
        (Vec3::new(max.x, min.y, min.z), Vec3::NEG_X * (max.x - min.x), columns[0]),
        (Vec3::new(min.x, min.y, min.z), Vec3::Z * (max.z - min.z), columns[1]),
    ];
    for (corner, right, columns) in walls {
        let right = right / columns as f32;
        let up = Vec3::Y * ((max.y - min.y) / rows);
        for (row, column) in (0..rows as u32).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let tint = if row == 0 { 0.8 } else { 1.0 };
            add_cell(builder, corner + right * column as f32 + up * row as f32, right, up, color_srgb * tint, rng);
        }
    }
    let roof_m = Vec3::new(0.0, 0.0, size.z * 0.5);
    let middle = (min + max) * 0.5;
    let roof = Vec3::new(middle.x, max.y, middle.z);
    builder.rectangle(roof, roof_m, Vec3::X * (size.x * 0.5), Vec3::new(118.0, 114.0, 110.0));
    add_frame(builder, [min, max], [max.y - 0.7, max.y + 1.0], [-0.45, 0.4], color_srgb * 0.86);
    let ledge_m = min.y + size.y / rows;
    add_frame(builder, [min, max], [ledge_m - 0.2, ledge_m + 0.2], [-0.2, 0.35], color_srgb * 1.06);
}

/// A closed rectangular ring around a box, from so far within its walls to so far before them.
fn add_frame(builder: &mut MeshBuilder, [min, max]: [Vec3; 2], y_m: [f32; 2], reach_m: [f32; 2], color: Vec3) {
    let outline = [(reach_m[0], y_m[0]), (reach_m[1], y_m[0]), (reach_m[1], y_m[1]), (reach_m[0], y_m[1])];
    builder.sweep_around(
        4,
        4,
        |station, i| {
            let (out_m, y_m) = outline[i as usize];
            let x = if station < 2 { max.x + out_m } else { min.x - out_m };
            let z = if station == 1 || station == 2 { max.z + out_m } else { min.z - out_m };
            Vec3::new(x, y_m, z)
        },
        |_, _| color,
    );
}

/// A piece of wall with a window: 18 triangles. It shares its neighbours' corners, so that no gap shows.
fn add_cell(builder: &mut MeshBuilder, corner: Vec3, right: Vec3, up: Vec3, color_srgb: Vec3, rng: &mut Rng) {
    let inwards = up.cross(right).normalize_or(Vec3::X) * RECESS_M;
    let width_m = right.length();
    let height_m = up.length();
    let [side, sill, lintel] = [0.9f32.min(0.2 * width_m) / width_m, 0.26, 1.0 - 0.5 / height_m];
    let [wall, hole] = [[0.0, 0.0, 1.0, 1.0], [side, sill, 1.0 - side, lintel]].map(|[left, low, far, high]| {
        [[left, low], [far, low], [far, high], [left, high]].map(|[s, t]| corner + right * s + up * t)
    });
    let pane = hole.map(|p| p + inwards);
    for i in 0..4 {
        let next = (i + 1) % 4;
        builder.facet([wall[i], wall[next], hole[next], hole[i]], color_srgb);
        builder.facet([hole[i], hole[next], pane[next], pane[i]], color_srgb * 0.9);
    }
    let is_curtained = rng.unit() < 0.15;
    let glass = if is_curtained { Vec3::new(150.0, 146.0, 132.0) } else { Vec3::new(62.0, 78.0, 94.0) };
    builder.facet(pane, glass * rng.between(0.8, 1.2));
}

/// The head of a staircase, air conditioners, and on some roofs a water tank on legs.
fn add_roof_details(builder: &mut MeshBuilder, middle: Vec2, half: Vec2, top_m: f32, rng: &mut Rng) {
    let mut place = |reach: f32| middle + half * Vec2::new(rng.between(-reach, reach), rng.between(-reach, reach));
    let stairs = at_height(place(0.3), top_m);
    add_box(builder, stairs, Vec3::new(3.0, 1.7, 2.2), Vec3::new(166.0, 160.0, 150.0));
    for _ in 0..3 {
        let conditioner = at_height(place(0.75), top_m);
        add_box(builder, conditioner, Vec3::new(1.3, 0.8, 1.0), Vec3::new(178.0, 182.0, 184.0));
    }
    let tank = place(0.7);
    if top_m > 18.0 {
        for (x, z) in [(-1.3, -1.3), (1.3, -1.3), (1.3, 1.3), (-1.3, 1.3)] {
            let leg = at_height(tank + Vec2::new(x, z), top_m);
            add_box(builder, leg, Vec3::new(0.15, 1.2, 0.15), Vec3::splat(70.0));
        }
        let foot = at_height(tank, top_m + 2.4);
        builder.drum(foot, [2.3, 2.3], 3.4, 12, Vec3::new(134.0, 96.0, 66.0));
        builder.drum(foot + Vec3::Y * 3.4, [2.5, 0.2], 1.3, 12, Vec3::new(92.0, 76.0, 66.0));
    }
}

/// A box with the middle of its underside at `foot`.
fn add_box(builder: &mut MeshBuilder, foot: Vec3, half_m: Vec3, color: Vec3) {
    let centre = foot.with_y(foot.y + half_m.y);
    builder.cuboid(centre - half_m, centre + half_m, color);
}
