//! Light gathered in layered light fields: the lobe of mirrors, and the edge of an occluder. By the host alone.

use depth_image::{Aabb, LayeredLightField, LightDirections, Ray, Reflector};
use glam::{Quat, Vec3};
use reconstruction::scalar::{Reflecting, gathered_light, gathered_light_with_exponent};

use crate::failures::cubes::{noise, unit};
use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::light_fields::{Lit, light_field};
use crate::failures::measures::mean;
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;

/// Half an edge of the room.
const HALF_M: f32 = 8.0;
const ROOM: Aabb = Aabb { min: Vec3::splat(-HALF_M), max: Vec3::splat(HALF_M) };
/// Lines along each side of a direction's square.
const LINES: u32 = 33;
/// From one line to the next along an axis of the room.
const SPACING_M: f32 = 2.0 * HALF_M / (LINES - 1) as f32;
const MIRRORS: u32 = 200;
/// The light of the room's checks, and of the sky, which gathering shows where no direction counts.
const CHECKS: [f32; 2] = [0.2, 0.8];
const SKY: f32 = 0.5;
/// Heights of a card over a mirror floor, in spacings.
const CARDS: [f32; 2] = [1.5, 8.0];
/// Places along the card's edge.
const PLACES: u32 = 100;

/// The sky alone has 10.5 dB, and black has 4.7.
const NEVER_BLACK: Shape = Shape::Bounded { least: 10.0, most: 30.0 };
const MIDDLE: Shape = Shape::EqualAt { x: 0.0, y: 0.5, tolerance: 0.05 };
const NARROW: &[Shape] = &[
    Shape::rises(0.9, 0.01),
    Shape::EqualAt { x: -2.0, y: 0.0, tolerance: 0.03 },
    MIDDLE,
    Shape::EqualAt { x: 2.0, y: 1.0, tolerance: 0.03 },
];

pub const CURVES: [Curve; 2] = [
    Curve {
        name: "Mirrors gathered against the lobe's exponent",
        subject: "200 mirrors of all directions in a room whose walls have four checks each, the twin",
        x: X::log("exponent of the cosine to the mirrored ray", "", &[1.0, 3.0, 10.0, 30.0, 120.0, 480.0, 1000.0]),
        y: ["PSNR of what mirrors show", "dB"],
        series: &[
            Series::new(
                "66 directions",
                &[Shape::InvertedU { peak_within: [20.0, 60.0], least_change: 3.0, tolerance: 0.1 }, NEVER_BLACK],
            ),
            Series::new(
                "258 directions",
                &[Shape::InvertedU { peak_within: [60.0, 240.0], least_change: 4.0, tolerance: 0.1 }, NEVER_BLACK],
            ),
            // Its peak is near the end.
            Series::new("1026 directions", &[Shape::rises(8.0, 0.6), NEVER_BLACK]),
        ],
        why: "A wide lobe blurs; a lobe narrower than the directions are apart holds none, and shows the sky.",
        measure: by_exponent,
    },
    Curve {
        name: "Light beside an occluder's edge",
        subject: "a mirror floor under a black card and a white ceiling, the twin",
        x: X::linear(
            "distance of the mirrored ray from the edge",
            "spacings of the lines",
            &[-3.0, -2.5, -2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0],
        ),
        y: ["share of the ceiling's light", ""],
        series: &[
            Series::new("66, card 1.5 spacings up", NARROW),
            Series::new("258, card 1.5 spacings up", NARROW),
            Series::new("1026, card 1.5 spacings up", NARROW),
            Series::new("66, card 8 spacings up", &[Shape::rises(0.7, 0.01), MIDDLE]),
            Series::new("258, card 8 spacings up", NARROW),
            Series::new("1026, card 8 spacings up", NARROW),
        ],
        why: "Light is the mean of four lines around the point, whatever stands between them, and of a lobe that widens with the distance.",
        measure: by_edge,
    },
];

/// Where a line leaves the room, and the light of the check there.
fn wall(ray: Ray) -> Option<Lit> {
    let slabs = [0, 1, 2].map(|axis| {
        let at = |half_m: f32| (half_m - ray.origin_in_world[axis]) / ray.direction_in_world[axis];
        [at(-HALF_M).min(at(HALF_M)), at(-HALF_M).max(at(HALF_M))]
    });
    let enters = slabs.iter().map(|slab| slab[0]).fold(f32::NEG_INFINITY, f32::max);
    let t = slabs.iter().map(|slab| slab[1]).fold(f32::INFINITY, f32::min);
    let is_bright = ray.at(t).cmplt(Vec3::ZERO).bitmask().count_ones().is_multiple_of(2);
    (enters < t).then_some(Lit { t, light: CHECKS[usize::from(is_bright)] })
}

/// A mirror that an eye sees head-on: the mirrored ray goes to the eye.
fn mirror(point_in_world: Vec3, towards: Vec3) -> Reflecting {
    Reflecting {
        point_in_world,
        normal_in_world: towards,
        towards_eye_in_world: towards,
        reflector: Reflector { reflectance_linear: Vec3::ONE, roughness: 0.0 },
    }
}

fn by_exponent(_: &Stand, exponents: &[f64]) -> anyhow::Result<Rows> {
    let fields = LightDirections::ALL
        .map(|directions| light_field(ROOM, (directions, LINES), |ray| wall(ray).into_iter().collect()));
    rows(exponents, |exponent| Ok(fields.each_ref().map(|field| psnr_db(field, exponent as f32))))
}

fn psnr_db(field: &LayeredLightField, exponent: f32) -> f64 {
    let squares = (0..MIRRORS).filter_map(|seed| {
        let [a, b, c, d, e] = noise(seed);
        let (point, towards) = (Vec3::new(a, b, c) * 4.0 - 2.0, unit([d, e]));
        let truth = wall(Ray { origin_in_world: point, direction_in_world: towards })?;
        let light = gathered_light_with_exponent(field, &mirror(point, towards), exponent, |_| Vec3::splat(SKY));
        Some(f64::from(light.y - truth.light).powi(2))
    });
    -10.0 * mean(squares).unwrap_or(f64::NAN).log10()
}

fn by_edge(_: &Stand, distances: &[f64]) -> anyhow::Result<Rows> {
    let fields = CARDS.map(|height| {
        LightDirections::ALL.map(|directions| light_field(ROOM, (directions, LINES), |ray| above(height, ray)))
    });
    rows(distances, |distance| {
        let [near, far] =
            fields.each_ref().map(|fields| fields.each_ref().map(|field| beside_edge(field, distance as f32)));
        Ok([near[0], near[1], near[2], far[0], far[1], far[2]])
    })
}

/// What a line up meets: the card, and the ceiling behind it.
fn above(height: f32, ray: Ray) -> Vec<Lit> {
    let upwards = ray.direction_in_world.y;
    let at = |height_m: f32| (height_m - HALF_M - ray.origin_in_world.y) / upwards;
    let card = Lit { t: at(height * SPACING_M), light: 0.0 };
    let ceiling = Lit { t: at(2.0 * HALF_M), light: 1.0 };
    let is_under_card = ray.at(card.t).dot(across_edge()) < 0.0;
    [is_under_card.then_some(card), Some(ceiling)].into_iter().flatten().filter(|_| upwards > 1e-3).collect()
}

/// From under the card outwards. The edge is turned against the lines, so that places along it lie anywhere between them.
fn across_edge() -> Vec3 {
    Quat::from_rotation_y(0.35) * Vec3::X
}

/// The mean light of places whose mirrored ray passes the edge at a distance.
fn beside_edge(field: &LayeredLightField, distance: f32) -> f64 {
    let along = across_edge().cross(Vec3::Y);
    let light = |place: u32| {
        let along_m = 6.0 * (place as f32 / PLACES as f32 - 0.5);
        let point = Vec3::NEG_Y * HALF_M + across_edge() * (distance * SPACING_M) + along * along_m;
        f64::from(gathered_light(field, &mirror(point, Vec3::Y), |_| Vec3::ONE).y)
    };
    mean((0..PLACES).map(light)).unwrap_or(f64::NAN)
}
