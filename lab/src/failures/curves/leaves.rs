//! Leaves in layered depth cubes: narrow ones, and many behind one another. By the host alone.

use depth_image::{LayeredDepthImage, Ray};
use glam::{Vec2, Vec3};
use reconstruction::scalar::CubeTwin;

use crate::failures::cubes::{self, Crossing, met_wrongly, missed, noise, unit};
use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;

/// Lines along an edge of the cube.
const SIDE: u32 = 24;
const RAYS: u32 = 2000;
const LEAVES: u32 = 80;
/// Half sides of leaves that are not narrow.
const HALF_M: f32 = 3.0;
const HALF_LENGTH_M: f32 = 8.0;
const SMALL_LEAVES: u32 = 300;
const SMALL_HALF_M: f32 = 0.7;
const BLADES: u32 = 40;
const RAYS_A_BLADE: u32 = 60;

pub const CURVES: [Curve; 3] = [
    Curve {
        name: "Narrow leaves in a cube",
        subject: "blades of all directions, the twin",
        x: X::log("width", "spacings", &[0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0]),
        y: ["rays through the blade missed, rays within half a spacing of it that hit", ""],
        series: &[Series::new("missed", &[Shape::falls(0.5, 0.01)]), Series::new("false", &[Shape::rises(0.15, 0.02)])],
        why: "A blade narrower than a spacing lies between two lines, or is shown as wide as a square.",
        measure: by_width,
    },
    Curve {
        name: "Surfaces missed against the layers of a line",
        subject: "80 leaves, seen from all around, lines cut behind their first layers, the twin",
        x: X::log("layers", "", &[1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 255.0]),
        y: ["rays to a leaf that miss it", ""],
        series: &[Series::new("layered", &[Shape::FallsThenFlat { least_fall: 0.3, tolerance: 0.01 }])],
        why: "Lines begin at one side of the scene: a viewer on the other side sees their last layers.",
        measure: by_layers,
    },
    Curve {
        name: "Small leaves against the axes that hold them",
        subject: "300 leaves of 1.4 spacings, kept where their normal has a share of its greatest component, the twin",
        x: X::linear("least share of the greatest component", "", &[0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]),
        y: ["rays to a leaf that miss it, samples over all", ""],
        series: &[
            Series::new("missed", &[Shape::rises(0.01, 0.005)]),
            Series::new("samples", &[Shape::falls(0.3, 0.0), Shape::EqualAt { x: 0.0, y: 1.0, tolerance: 0.0 }]),
        ],
        why: "A leaf smaller than √3 spacings is met by chance: each further axis that holds it is one more chance.",
        measure: by_share,
    },
];

/// A rectangle with two sides.
#[derive(Debug, Clone, Copy)]
struct Leaf {
    middle: Vec3,
    normal: Vec3,
    right: Vec3,
    half_m: Vec2,
}

impl Leaf {
    /// In any direction, its middle in the middle third of the cube or so.
    fn new(seed: u32, spread_m: f32, half_m: Vec2) -> Self {
        let [a, b, turn, x, y, z] = noise(seed);
        let normal = unit([a, b]);
        let (right, up) = normal.any_orthonormal_pair();
        let [cos, sin] = Vec2::from_angle(std::f32::consts::TAU * turn).to_array();
        let middle = Vec3::splat(0.5 * (SIDE - 1) as f32) + (Vec3::new(x, y, z) - 0.5) * spread_m;
        Self { middle, normal, right: right * cos + up * sin, half_m }
    }

    fn at(&self, place_m: Vec2) -> Vec3 {
        self.middle + self.right * place_m.x + self.normal.cross(self.right) * place_m.y
    }

    /// Both sides where a ray crosses it.
    fn crossings(&self, ray: Ray) -> impl Iterator<Item = Crossing> {
        let normal = self.normal;
        let t = normal.dot(self.middle - ray.origin_in_world) / normal.dot(ray.direction_in_world);
        let off = ray.origin_in_world + ray.direction_in_world * t - self.middle;
        let place = Vec2::new(off.dot(self.right), off.dot(normal.cross(self.right)));
        let is_crossed = t.is_finite() && place.abs().cmple(self.half_m).all();
        is_crossed
            .then_some([normal, -normal])
            .into_iter()
            .flatten()
            .map(move |normal_in_world| Crossing { t, normal_in_world })
    }
}

fn by_width(_: &Stand, widths: &[f64]) -> anyhow::Result<Rows> {
    let grid = cubes::grid(SIDE)?;
    rows(widths, |width| {
        let half_m = Vec2::new(HALF_LENGTH_M, 0.5 * width as f32);
        let (mut onto, mut beside) = (Vec::new(), Vec::new());
        for blade in 0..BLADES {
            let leaf = Leaf::new(blade, 1.0, half_m);
            let crossings = |ray| leaf.crossings(ray).collect::<Vec<_>>();
            let twin = cubes::cube(&grid, crossings);
            for seed in 0..RAYS_A_BLADE {
                let [along, across, a, b] = noise(seed + RAYS_A_BLADE * blade);
                // Within 60° of the normal.
                let from = leaf.normal + 1.7 * a * (leaf.at(Vec2::from_angle(std::f32::consts::TAU * b)) - leaf.middle);
                let place = Vec2::new(2.0 * along - 1.0, 2.0 * across - 1.0);
                let outside = Vec2::new(place.x * half_m.x, (half_m.y + 0.5 * place.y.abs()).copysign(place.y));
                let met = |place| cubes::both(&twin, crossings, cubes::ray_to(leaf.at(place), from));
                onto.push(met(place * half_m));
                beside.push(met(outside));
            }
        }
        Ok([missed(onto), met_wrongly(beside)])
    })
}

fn by_layers(_: &Stand, counts: &[f64]) -> anyhow::Result<Rows> {
    let grid = cubes::grid(SIDE)?;
    let leaves: Vec<Leaf> = (0..LEAVES).map(|seed| Leaf::new(seed, 14.0, Vec2::splat(HALF_M))).collect();
    let crossings = |ray| leaves.iter().flat_map(|leaf| leaf.crossings(ray)).collect::<Vec<_>>();
    let images = [0, 1, 2].map(|axis| cubes::image(&grid, axis, cubes::DOMINANT, crossings));
    rows(counts, |layers| {
        let twin = CubeTwin::new(&grid, &images.each_ref().map(|image| cut(image, layers as usize)));
        let rays = cubes::rays_around(Vec3::splat(0.5 * (SIDE - 1) as f32), 9.0, RAYS);
        Ok([missed(rays.map(|ray| cubes::both(&twin, crossings, ray)))])
    })
}

fn by_share(_: &Stand, shares: &[f64]) -> anyhow::Result<Rows> {
    let grid = cubes::grid(SIDE)?;
    let leaves: Vec<Leaf> = (0..SMALL_LEAVES).map(|seed| Leaf::new(seed, 16.0, Vec2::splat(SMALL_HALF_M))).collect();
    let crossings = |ray| leaves.iter().flat_map(|leaf| leaf.crossings(ray)).collect::<Vec<_>>();
    let kept = |share: f32| [0, 1, 2].map(|axis| cubes::image(&grid, axis, share, crossings));
    let samples = |images: &[LayeredDepthImage; 3]| images.iter().map(LayeredDepthImage::sample_count).sum::<usize>();
    let all = samples(&kept(0.0));
    rows(shares, |share| {
        let images = kept(share as f32);
        let twin = CubeTwin::new(&grid, &images);
        let rays = cubes::rays_around(Vec3::splat(0.5 * (SIDE - 1) as f32), 9.0, RAYS);
        let met = rays.map(|ray| cubes::both(&twin, crossings, ray));
        Ok([missed(met), samples(&images) as f64 / all as f64])
    })
}

/// The first layers of each line.
fn cut(image: &LayeredDepthImage, layers: usize) -> LayeredDepthImage {
    let lines = 0..image.camera.pixel_count();
    let held: Vec<usize> = lines.clone().flat_map(|line| image.line(line).take(layers)).collect();
    let ends = lines.scan(0, |end, line| {
        *end += image.line(line).len().min(layers) as u32;
        Some(*end)
    });
    LayeredDepthImage {
        first: [0].into_iter().chain(ends).collect(),
        planar_depth_m: held.iter().map(|&sample| image.planar_depth_m[sample]).collect(),
        plane_normal_oct8: held.iter().map(|&sample| image.plane_normal_oct8[sample]).collect(),
        color_rgb9e5: vec![0; held.len()],
        truncated: held.len() < image.sample_count(),
        ..image.clone()
    }
}
