//! The inside of the nest: the field, three tiers of stands, and the floors behind them.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::super::geometry::{MeshBuilder, on_ellipse, vertex};
use super::super::random::{Rng, mix, mixed};
use super::shell::{SECTORS, SEED};

/// Half axes of the front row, and of the rearmost one.
const FRONT_M: Vec2 = Vec2::new(100.0, 72.0);
const BACK_M: Vec2 = Vec2::new(141.0, 124.0);
/// Half axes of the field, of the track around it, and of the ground around all.
const FIELD_M: Vec2 = Vec2::new(84.0, 55.0);
const TRACK_M: Vec2 = Vec2::new(96.0, 68.0);
const PLAZA_M: Vec2 = Vec2::new(190.0, 172.0);
const LAWN_M: Vec2 = Vec2::new(225.0, 208.0);

struct Tier {
    rows: u32,
    /// Share of the way from the front row to the rearmost.
    reach: [f32; 2],
    heights_m: [f32; 2],
}

const TIERS: [Tier; 3] = [
    Tier { rows: 9, reach: [0.0, 0.42], heights_m: [1.5, 11.0] },
    Tier { rows: 8, reach: [0.36, 0.70], heights_m: [16.0, 25.0] },
    Tier { rows: 9, reach: [0.64, 1.0], heights_m: [29.0, 41.0] },
];
/// Between a tier's lowest step and its underside.
const SLAB_M: f32 = 1.2;
/// Additional rise of the stands towards the middle of the long sides, and reduction towards the ends.
const SADDLE: f32 = 0.14;

/// Level ground at y = 0, in rings of one colour each around the middle of the field.
pub(super) fn add_ground(builder: &mut MeshBuilder) {
    let at =
        |half_axes_m: Vec2, sector: u32| on_ellipse(half_axes_m, TAU * (sector % SECTORS) as f32 / SECTORS as f32, 0.0);
    let rings = [
        (FIELD_M * 0.5, FIELD_M, Vec3::new(86.0, 138.0, 62.0)),
        (FIELD_M, TRACK_M, Vec3::new(170.0, 76.0, 58.0)),
        (TRACK_M, PLAZA_M, Vec3::new(172.0, 168.0, 160.0)),
        (PLAZA_M, LAWN_M, Vec3::new(112.0, 134.0, 82.0)),
    ];
    for sector in 0..SECTORS {
        // The field is mown in stripes.
        let stripe = if (sector / 6).is_multiple_of(2) { 1.0 } else { 0.9 };
        for (inner, outer, color) in rings {
            let shade = if outer == FIELD_M { stripe } else { 1.0 };
            builder.facet(
                [at(inner, sector), at(inner, sector + 1), at(outer, sector + 1), at(outer, sector)],
                color * shade,
            );
        }
    }
    // The middle, as a disc.
    let middle = builder.push(vertex(Vec3::ZERO, Vec3::Y, Vec3::new(92.0, 146.0, 66.0)));
    for sector in 0..SECTORS {
        builder.push(vertex(at(FIELD_M * 0.5, sector), Vec3::Y, Vec3::new(86.0, 138.0, 62.0)));
    }
    for sector in 0..SECTORS {
        builder.indices.extend([middle, middle + 1 + (sector + 1) % SECTORS, middle + 1 + sector]);
    }
}

/// Stands, floors and the wall behind them, each a closed solid.
pub(super) fn add(builder: &mut MeshBuilder) {
    TIERS.iter().enumerate().for_each(|(number, tier)| add_tier(builder, number, tier));
    let red = Vec3::new(150.0, 44.0, 38.0);
    add_ring(builder, [BACK_M * 0.985, BACK_M], [0.0, 33.0], red);
    for floor in 1..=4 {
        let top_m = 7.5 * floor as f32;
        add_ring(builder, [BACK_M, BACK_M + 7.0], [top_m - 0.8, top_m], Vec3::splat(150.0));
    }
}

fn add_tier(builder: &mut MeshBuilder, number: usize, tier: &Tier) {
    let outline = tier.outline();
    let height = |angle_rad: f32, point: Vec2| {
        let saddle = 1.0 - SADDLE * (2.0 * angle_rad).cos() * point.x;
        on_ellipse(FRONT_M.lerp(BACK_M, point.x), angle_rad, point.y * saddle)
    };
    let point = |station: u32, i: u32| height(TAU * station as f32 / SECTORS as f32, outline[i as usize]);
    let mut rng = Rng::new(SEED, 10 + number as u64);
    let colors = |station: u32, i: u32| {
        // After the underside and the rear, treads and risers alternate, from the top down.
        if i < 2 || i + 1 >= outline.len() as u32 {
            return Vec3::new(158.0, 154.0, 148.0);
        }
        let is_aisle = station.is_multiple_of(8);
        let height = (number as f32 + 1.0 - i as f32 / outline.len() as f32) / TIERS.len() as f32;
        let red = Vec3::new(186.0, 48.0, 42.0);
        let is_light = rng.unit() < height * height;
        let seat = if is_light { Vec3::new(214.0, 206.0, 198.0) } else { red };
        let patch = (mixed(u64::from(station / 4)) % 16) as f32 / 100.0;
        let seat = mix(seat, red * 0.8, patch);
        let is_tread = i.is_multiple_of(2);
        if is_aisle { Vec3::splat(136.0) } else { seat * if is_tread { 0.72 } else { 1.0 } }
    };
    builder.sweep_around(SECTORS, outline.len() as u32, point, colors);
}

impl Tier {
    /// Its section: x is the way from the front row (0) to the rearmost (1), y is metres.
    fn outline(&self) -> Vec<Vec2> {
        let [front, back] = self.reach;
        let [low_m, high_m] = self.heights_m;
        let step = Vec2::new(back - front, high_m - low_m) / self.rows as f32;
        let mut points = vec![Vec2::new(front, low_m - SLAB_M), Vec2::new(back, high_m - step.y - SLAB_M)];
        for row in (0..self.rows).rev() {
            let y_m = low_m + step.y * (row + 1) as f32;
            points.push(Vec2::new(front + step.x * (row + 1) as f32, y_m));
            points.push(Vec2::new(front + step.x * row as f32, y_m));
        }
        points
    }
}

/// A closed ring between two ellipses.
fn add_ring(builder: &mut MeshBuilder, [inner, outer]: [Vec2; 2], [low_m, high_m]: [f32; 2], color_srgb: Vec3) {
    let outline = [(inner, low_m), (outer, low_m), (outer, high_m), (inner, high_m)];
    let point = |station: u32, i: u32| {
        let (half_axes_m, y_m) = outline[i as usize];
        on_ellipse(half_axes_m, TAU * station as f32 / SECTORS as f32, y_m)
    };
    builder.sweep_around(SECTORS, 4, point, |_, _| color_srgb);
}
