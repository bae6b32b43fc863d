//! Light gathered in layered light fields, beside the edge of an occluder. By the host alone.

use depth_image::{Aabb, LayeredLightField, LightDirections, LightFieldCamera, Ray, Reflector, rgb9e5_from_linear};
use glam::{Quat, Vec2, Vec3};
use reconstruction::scalar::{Reflecting, gathered_light};

use crate::failures::curve::{Curve, Rows, Series, X, rows};
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
/// Heights of a card over a mirror floor, in spacings.
const CARDS: [f32; 2] = [1.5, 8.0];
/// Places along the card's edge.
const PLACES: u32 = 100;

const MIDDLE: Shape = Shape::EqualAt { x: 0.0, y: 0.5, tolerance: 0.05 };
const NARROW: &[Shape] = &[
    Shape::rises(0.9, 0.01),
    Shape::EqualAt { x: -2.0, y: 0.0, tolerance: 0.03 },
    MIDDLE,
    Shape::EqualAt { x: 2.0, y: 1.0, tolerance: 0.03 },
];

pub const CURVE: Curve = Curve {
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
    measure,
};

/// A surface on a line that faces back along it.
#[derive(Debug, Clone, Copy)]
struct Lit {
    /// The line's parameter.
    t: f32,
    /// Grey, linear.
    light: f32,
}

fn measure(_: &Stand, distances: &[f64]) -> anyhow::Result<Rows> {
    let fields = CARDS.map(|height| LightDirections::ALL.map(|directions| light_field(directions, height)));
    rows(distances, |distance| {
        let [near, far] =
            fields.each_ref().map(|fields| fields.each_ref().map(|field| beside_edge(field, distance as f32)));
        Ok([near[0], near[1], near[2], far[0], far[1], far[2]])
    })
}

/// The light field of the card and of the ceiling.
fn light_field(directions: LightDirections, card_height: f32) -> LayeredLightField {
    let camera = LightFieldCamera::around(ROOM, directions, LINES);
    let mut first = vec![0];
    let mut samples = Vec::new();
    for direction in directions.all() {
        let lines = camera.lines(direction.towards);
        for place in (0..LINES).flat_map(|y| (0..LINES).map(move |x| Vec2::new(x as f32, y as f32))) {
            let mut line = above(card_height, lines.ray(place + 0.5));
            line.retain(|lit| (0.0..=lines.range_m).contains(&lit.t));
            line.sort_by(|a, b| a.t.total_cmp(&b.t));
            samples.extend(line);
            first.push(samples.len() as u32);
        }
    }
    LayeredLightField {
        camera,
        first,
        planar_depth_m: samples.iter().map(|lit| lit.t).collect(),
        radiance_rgb9e5: samples.iter().map(|lit| rgb9e5_from_linear(Vec3::splat(lit.light))).collect(),
    }
}

/// What a line up meets: the card, and the ceiling behind it.
fn above(height: f32, ray: Ray) -> Vec<Lit> {
    let upwards = ray.direction_in_world.y;
    let [card, ceiling] = [(height * SPACING_M, 0.0), (2.0 * HALF_M, 1.0)]
        .map(|(height_m, light)| Lit { t: (height_m - HALF_M - ray.origin_in_world.y) / upwards, light });
    let is_under_card = ray.at(card.t).dot(across_edge()) < 0.0;
    [is_under_card.then_some(card), Some(ceiling)].into_iter().flatten().filter(|_| upwards > 1e-3).collect()
}

/// From under the card outwards. The edge is turned against the lines, so that places along it lie anywhere between them.
fn across_edge() -> Vec3 {
    Quat::from_rotation_y(0.35) * Vec3::X
}

/// The mean light of places whose mirrored ray passes the edge at a distance. An eye sees the floor head-on.
fn beside_edge(field: &LayeredLightField, distance: f32) -> f64 {
    let along = across_edge().cross(Vec3::Y);
    let light = (0..PLACES).map(|place| {
        let along_m = 6.0 * (place as f32 / PLACES as f32 - 0.5);
        let floor = Reflecting {
            point_in_world: Vec3::NEG_Y * HALF_M + across_edge() * (distance * SPACING_M) + along * along_m,
            normal_in_world: Vec3::Y,
            towards_eye_in_world: Vec3::Y,
            reflector: Reflector { reflectance_linear: Vec3::ONE, roughness: 0.0 },
        };
        f64::from(gathered_light(field, &floor, |_| Vec3::ONE).y)
    });
    mean(light).unwrap_or(f64::NAN)
}
