//! The plan of the city; streets, pavements and parks, with trees, lamps and cars.

use glam::{Vec2, Vec3};

use super::super::geometry::MeshBuilder;
use super::super::random::{Noise, Rng, mix};
use super::at_height;

pub(super) const SEED: u64 = 1950;

pub(super) const HALF_WIDTH_M: f32 = 200.0;
/// Number of blocks a side; each has streets on all sides.
const BLOCKS: u32 = 3;
const STREET_M: f32 = 19.0;
pub(super) const BLOCK_M: f32 = (2.0 * HALF_WIDTH_M - (BLOCKS + 1) as f32 * STREET_M) / BLOCKS as f32;
pub(super) const KERB_M: f32 = 0.2;

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

/// The corner of least x and z of each block.
pub(super) fn blocks() -> impl Iterator<Item = Vec2> {
    (0..BLOCKS * BLOCKS).map(|i| {
        Vec2::from([i % BLOCKS, i / BLOCKS].map(|i| -HALF_WIDTH_M + STREET_M + i as f32 * (BLOCK_M + STREET_M)))
    })
}

/// One large square, with dashes along the middle of each street.
pub(super) fn add_ground(builder: &mut MeshBuilder) {
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
pub(super) fn add_pavement(builder: &mut MeshBuilder, corner: Vec2) {
    let grey = Vec3::new(160.0, 156.0, 150.0);
    builder.cuboid(at_height(corner, -0.2), at_height(corner + BLOCK_M, KERB_M), grey);
}

/// A lawn with trees, `half_m` to each side.
pub(super) fn add_park(builder: &mut MeshBuilder, middle: Vec2, half_m: f32, rng: &mut Rng) {
    let lawn = Vec3::new(104.0, 130.0, 70.0);
    builder.cuboid(at_height(middle - half_m, 0.0), at_height(middle + half_m, KERB_M + 0.3), lawn);
    for i in 0..9 {
        let cell = Vec2::new((i % 3) as f32 - 1.0, (i / 3) as f32 - 1.0) * 0.62;
        let at = middle + (cell + Vec2::new(rng.between(-0.2, 0.2), rng.between(-0.2, 0.2))) * half_m;
        add_tree(builder, at_height(at, KERB_M + 0.3), rng.between(0.9, 1.5), rng);
    }
}

/// Trees and lamps along the pavements, and parked cars until the mesh has `triangles`.
pub(super) fn add_furniture(builder: &mut MeshBuilder, triangles: u32) {
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
