//! A few blocks of a city: large flat walls and streets, with recesses, ledges and clutter on them.

use glam::{Vec2, Vec3};

use super::parts::{MeshBuilder, Noise, Rng, matt, mix};
use crate::{Environment, Scene};

const SEED: u64 = 1950;

const HALF_WIDTH_M: f32 = 200.0;
/// Number of blocks a side; each has streets on all sides.
const BLOCKS: u32 = 3;
const STREET_M: f32 = 19.0;
const BLOCK_M: f32 = (2.0 * HALF_WIDTH_M - (BLOCKS + 1) as f32 * STREET_M) / BLOCKS as f32;
const KERB_M: f32 = 0.2;

/// Height of paint above a street, enough for 16 bits of depth to separate them.
const PAINT_M: f32 = 0.05;
const DASHES: u32 = 26;
/// Trees a side of a block, lamps between them, and places to park.
const TREES: u32 = 4;
const PARKING: u32 = 13;
const CAR_TRIANGLES: u32 = 24;

const CARS_SRGB: [[f32; 3]; 6] = [
    [196.0, 198.0, 200.0],
    [44.0, 46.0, 52.0],
    [150.0, 40.0, 36.0],
    [48.0, 78.0, 132.0],
    [222.0, 220.0, 212.0],
    [96.0, 104.0, 100.0],
];

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

/// Number of triangles of the model in the paper's table 1.
const TRIANGLES: u32 = 50_000;
/// Distance from the kerb to the buildings.
const PAVEMENT_M: f32 = 5.0;

/// Nine blocks of buildings and towers around the origin, 400 m × 400 m, with streets at y = 0: 50,000 triangles.
#[must_use]
pub fn urban() -> Scene {
    let mut builder = MeshBuilder::default();
    add_ground(&mut builder);
    builder.finish_part(0);
    let mut rng = Rng::new(SEED, 1);
    blocks().enumerate().for_each(|(number, corner)| add_block(&mut builder, number, corner, &mut rng));
    builder.finish_part(1);
    add_furniture(&mut builder, TRIANGLES);
    builder.finish_part(2);
    let scene = builder.into_scene_of("urban", vec![matt("street"), matt("houses"), matt("furniture")]);
    Scene { background: Environment::uniform(Vec3::new(0.52, 0.62, 0.76)), ..scene }
}

/// Quarters of blocks that are parks: (block, quarter).
const PARKS: [(usize, u32); 5] = [(1, 3), (4, 1), (4, 3), (6, 1), (8, 0)];

/// A place on the plan, at a height.
fn at_height(on_plan: Vec2, y_m: f32) -> Vec3 {
    Vec3::new(on_plan.x, y_m, on_plan.y)
}

fn add_block(builder: &mut MeshBuilder, number: usize, corner: Vec2, rng: &mut Rng) {
    add_pavement(builder, corner);
    let quarter_m = (BLOCK_M - 2.0 * PAVEMENT_M) * 0.5;
    for quarter in 0..4 {
        let offset = Vec2::new((quarter % 2) as f32, (quarter / 2) as f32) * quarter_m + PAVEMENT_M;
        let middle = corner + offset + quarter_m * 0.5;
        if PARKS.contains(&(number, quarter)) {
            add_park(builder, middle, quarter_m * 0.5 - 2.0, rng);
        } else {
            // Tower blocks stand in the middle of the city.
            let is_central = middle.length() < 0.55 * HALF_WIDTH_M;
            add_building(builder, middle, quarter_m * 0.5, is_central, rng);
        }
    }
}

// The plan of the city; streets, pavements and parks, with trees, lamps and cars.

/// The corner of least x and z of each block.
fn blocks() -> impl Iterator<Item = Vec2> {
    (0..BLOCKS * BLOCKS).map(|i| {
        Vec2::from([i % BLOCKS, i / BLOCKS].map(|i| -HALF_WIDTH_M + STREET_M + i as f32 * (BLOCK_M + STREET_M)))
    })
}

/// One large square, with dashes along the middle of each street.
fn add_ground(builder: &mut MeshBuilder) {
    builder.rectangle(Vec3::ZERO, Vec3::Z * HALF_WIDTH_M, Vec3::X * HALF_WIDTH_M, Vec3::new(84.0, 84.0, 88.0));
    let paint = Vec3::new(206.0, 204.0, 190.0);
    for street in 0..=BLOCKS {
        let across_m = -HALF_WIDTH_M + 0.5 * STREET_M + street as f32 * (BLOCK_M + STREET_M);
        for dash in 0..DASHES {
            let along_m = (2.0 * (dash as f32 + 0.5) / DASHES as f32 - 1.0) * HALF_WIDTH_M;
            let long_m = 3.2;
            let wide_m = 0.2;
            let [x, z] = [along_m, across_m];
            builder.rectangle(Vec3::new(x, PAINT_M, z), Vec3::Z * wide_m, Vec3::X * long_m, paint);
            builder.rectangle(Vec3::new(z, PAINT_M, x), Vec3::Z * long_m, Vec3::X * wide_m, paint);
        }
    }
}

/// A block's slab, up to the kerb.
fn add_pavement(builder: &mut MeshBuilder, corner: Vec2) {
    let grey = Vec3::new(160.0, 156.0, 150.0);
    builder.cuboid(at_height(corner, -0.2), at_height(corner + BLOCK_M, KERB_M), grey);
}

/// A lawn with trees, `half_m` to each side.
fn add_park(builder: &mut MeshBuilder, middle: Vec2, half_m: f32, rng: &mut Rng) {
    let lawn = Vec3::new(104.0, 130.0, 70.0);
    builder.cuboid(at_height(middle - half_m, 0.0), at_height(middle + half_m, KERB_M + 0.3), lawn);
    for i in 0..9 {
        let cell = Vec2::new((i % 3) as f32 - 1.0, (i / 3) as f32 - 1.0) * 0.62;
        let at = middle + (cell + Vec2::new(rng.between(-0.2, 0.2), rng.between(-0.2, 0.2))) * half_m;
        add_tree(builder, at_height(at, KERB_M + 0.3), rng.between(0.9, 1.5), rng);
    }
}

/// Trees and lamps along the pavements, and parked cars until the mesh has `triangles`.
fn add_furniture(builder: &mut MeshBuilder, triangles: u32) {
    let mut rng = Rng::new(SEED, 2);
    for side in sides() {
        for i in 0..TREES {
            let along_m = BLOCK_M * (i as f32 + 0.5) / TREES as f32;
            add_tree(builder, side.at(along_m, -2.2, KERB_M), rng.between(0.7, 1.0), &mut rng);
        }
        for i in 1..TREES {
            add_lamp(builder, &side, BLOCK_M * i as f32 / TREES as f32);
        }
    }
    let places: Vec<(Side, u32)> = sides().flat_map(|side| (0..PARKING).map(move |i| (side, i))).collect();
    let cars = (triangles.saturating_sub(builder.triangle_count()) / CAR_TRIANGLES).min(places.len() as u32);
    for car in 0..cars as usize {
        // Cars are spread evenly over the city for any number.
        let (side, place) = &places[car * places.len() / cars as usize];
        let along_m = 8.0 + (BLOCK_M - 16.0) * (*place as f32 + 0.5) / PARKING as f32;
        add_car(builder, side, along_m, &mut rng);
    }
}

/// A side of a block, along its kerb.
#[derive(Clone, Copy)]
struct Side {
    corner: Vec2,
    along: Vec2,
    /// Into the street.
    out: Vec2,
}

impl Side {
    fn at(&self, along_m: f32, out_m: f32, y_m: f32) -> Vec3 {
        at_height(self.corner + self.along * along_m + self.out * out_m, y_m)
    }

    /// A box between two places along, out and up.
    fn cuboid(&self, builder: &mut MeshBuilder, from: Vec3, to: Vec3, color_srgb: Vec3) {
        let [a, b] = [from, to].map(|p| self.at(p.x, p.y, p.z));
        builder.cuboid(a.min(b), a.max(b), color_srgb);
    }
}

fn sides() -> impl Iterator<Item = Side> {
    blocks().flat_map(|corner| {
        let far = corner + BLOCK_M;
        [
            Side { corner, along: Vec2::X, out: Vec2::NEG_Y },
            Side { corner: Vec2::new(corner.x, far.y), along: Vec2::X, out: Vec2::Y },
            Side { corner, along: Vec2::Y, out: Vec2::NEG_X },
            Side { corner: Vec2::new(far.x, corner.y), along: Vec2::Y, out: Vec2::X },
        ]
    })
}

fn add_tree(builder: &mut MeshBuilder, foot: Vec3, size: f32, rng: &mut Rng) {
    builder.drum(foot - Vec3::Y * 0.1, [0.24 * size, 0.16 * size], 3.6 * size, 4, Vec3::new(92.0, 74.0, 56.0));
    let radii_m = Vec3::new(rng.between(2.2, 2.9), rng.between(2.4, 3.2), rng.between(2.2, 2.9)) * size;
    let green = mix(Vec3::new(74.0, 110.0, 48.0), Vec3::new(126.0, 142.0, 66.0), rng.unit());
    let crown = foot + Vec3::Y * (3.1 * size + 0.8 * radii_m.y);
    builder.lumpy_ball(crown, radii_m, &Noise::new(SEED), green);
}

/// A mast at the kerb with an arm over the street.
fn add_lamp(builder: &mut MeshBuilder, side: &Side, along_m: f32) {
    let grey = Vec3::new(72.0, 76.0, 80.0);
    let mut part = |from: [f32; 3], to: [f32; 3], color: Vec3| {
        side.cuboid(builder, Vec3::X * along_m + Vec3::from(from), Vec3::X * along_m + Vec3::from(to), color);
    };
    part([-0.12, -0.9, KERB_M - 0.05], [0.12, -0.66, 8.0], grey);
    part([-0.08, -0.66, 7.7], [0.08, 1.4, 7.9], grey);
    part([-0.25, 1.4, 7.6], [0.25, 2.4, 7.95], Vec3::new(214.0, 210.0, 190.0));
}

fn add_car(builder: &mut MeshBuilder, side: &Side, along_m: f32, rng: &mut Rng) {
    let color = Vec3::from(CARS_SRGB[(rng.unit() * CARS_SRGB.len() as f32) as usize]);
    let middle = Vec3::new(along_m + rng.between(-0.8, 0.8), 1.4, 0.0);
    side.cuboid(builder, middle + Vec3::new(-2.2, -0.9, 0.25), middle + Vec3::new(2.2, 0.9, 0.95), color);
    let glass = Vec3::new(52.0, 60.0, 68.0);
    side.cuboid(builder, middle + Vec3::new(-1.3, -0.78, 0.95), middle + Vec3::new(1.2, 0.78, 1.5), glass);
}

// Buildings: walls with recessed windows, ledges, and roofs with parapets and fittings.

/// A building on a quarter of a block, `half_m` to each side of `middle`.
fn add_building(builder: &mut MeshBuilder, middle: Vec2, half_m: f32, is_central: bool, rng: &mut Rng) {
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
