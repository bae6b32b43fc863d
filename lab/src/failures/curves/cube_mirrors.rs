//! Mirrors in layered depth cubes: a ball on a mirror floor, and the bits of normals. By the host alone.

use depth_image::{Ray, oct8_from_unit, oct16_from_unit, unit_from_oct8, unit_from_oct16};
use glam::Vec3;

use crate::failures::cubes::{self, Crossing, missed, noise, unit};
use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;

/// Lines along an edge of the cube.
const SIDE: u32 = 24;
/// A ball between all lines, and the floor that it touches.
const BALL_IN_WORLD: Vec3 = Vec3::new(11.3, 9.6, 11.7);
const RADIUS_M: f32 = 8.0;
const FLOOR_M: f32 = BALL_IN_WORLD.y - RADIUS_M;
const RAYS: u32 = 2000;
/// The height above the mirror at which the walk starts rays, in spacings. Along a slanting ray it starts at most four times as far.
const START_SPACINGS: f32 = 0.75;
const LEAST_RISE: f32 = 0.25;
/// A view of 200 pixels in 23°.
const FOCAL_PX: f64 = 500.0;

pub const CURVES: [Curve; 2] = [
    Curve {
        name: "A ball on a mirror floor",
        subject: "rays off the floor to a ball of 8 spacings that touches it, the twin",
        x: X::linear("distance from the contact", "spacings", &[0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]),
        y: ["rays to the ball that miss it", ""],
        series: &[
            Series::new(
                "from 0.75 spacings above",
                &[Shape::falls(0.8, 0.01), Shape::EqualAt { x: 8.0, y: 0.0, tolerance: 0.02 }],
            ),
            Series::new("from the floor", &[Shape::Bounded { least: 0.0, most: 0.3 }]),
        ],
        why: "Rays off a mirror meet nothing near it, so that they do not meet the mirror's own samples.",
        measure: by_distance,
    },
    Curve {
        name: "Displacement in mirrors against the bits of normals",
        subject: "2,000 mirrors of all directions, their normals in two bytes and in two 16-bit numbers",
        x: X::log("distance of what is mirrored over that of the mirror", "", &[0.1, 0.3, 1.0, 3.0, 10.0, 100.0]),
        y: ["greatest displacement of the mirrored picture", "px"],
        series: &[
            Series::new("8 bits", &[Shape::rises(5.0, 0.0)]),
            Series::new("16 bits", &[Shape::Bounded { least: 0.0, most: 0.25 }]),
        ],
        why: "A mirrored ray turns by twice the error of the normal, which a sample's plane need not know as well.",
        measure: by_bits,
    },
];

fn ball(ray: Ray) -> Vec<Crossing> {
    let (off, towards) = (ray.origin_in_world - BALL_IN_WORLD, ray.direction_in_world);
    let [a, b, c] = [towards.length_squared(), off.dot(towards), off.length_squared() - RADIUS_M * RADIUS_M];
    let root = (b * b - a * c).max(0.0).sqrt();
    let at = |t: f32| Crossing { t, normal_in_world: (off + towards * t) / RADIUS_M };
    if b * b > a * c { vec![at((-b - root) / a), at((-b + root) / a)] } else { Vec::new() }
}

fn by_distance(_: &Stand, distances: &[f64]) -> anyhow::Result<Rows> {
    let twin = cubes::cube(&cubes::grid(SIDE)?, ball);
    rows(distances, |distance| {
        let rays = (0..RAYS).map(|seed| {
            let [around, turn, rise] = noise(seed);
            let at = |turns: f32| Vec3::Y.any_orthonormal_pair().0.rotate_y(std::f32::consts::TAU * turns);
            let origin_in_world = BALL_IN_WORLD.with_y(FLOOR_M) + at(around) * distance as f32;
            let rise = 0.1 + 0.9 * rise;
            Ray { origin_in_world, direction_in_world: at(turn) * (1.0 - rise * rise).sqrt() + Vec3::Y * rise }
        });
        let from = |ray: Ray, above: f32| {
            let near = above / ray.direction_in_world.y.max(LEAST_RISE);
            (cubes::nearest(ray, ball), twin.walk(ray, near).map(|hit| hit.t))
        };
        let [above, floor] = [START_SPACINGS, 0.0].map(|above| missed(rays.clone().map(|ray| from(ray, above))));
        Ok([above, floor])
    })
}

fn by_bits(_: &Stand, distances: &[f64]) -> anyhow::Result<Rows> {
    let held: [fn(Vec3) -> Vec3; 2] =
        [|normal| unit_from_oct8(oct8_from_unit(normal)), |normal| unit_from_oct16(oct16_from_unit(normal))];
    rows(distances, |distance| {
        // A mirrored point that is displaced, as seen from the eye.
        let share = distance / (1.0 + distance);
        Ok(held.map(|held| (0..RAYS).map(|seed| turn(seed, held) * share * FOCAL_PX).fold(0.0, f64::max)))
    })
}

/// The distance, at a length of 1, of a ray off a mirror from that off the mirror as it is held.
fn turn(seed: u32, held: fn(Vec3) -> Vec3) -> f64 {
    let [a, b, c, d] = noise(seed);
    let (normal, towards) = (unit([a, b]), unit([c, d]));
    let [truth, mirrored] = [normal, held(normal)].map(|normal| towards.reflect(normal));
    f64::from(truth.distance(mirrored))
}
