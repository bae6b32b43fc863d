//! Layered depth cubes: texels that grow in the picture, leaves, and mirrors that touch what they show. All but the first by the
//! host alone.

use depth_image::{Aabb, CubeGrid, CubeImages, LayeredDepthImage, PinholeCamera, Ray, ViewPlanes};
use glam::{Vec2, Vec3};
use gpu::Turn;
use reconstruction::scalar::CubeTwin;
use reconstruction::{ReconstructRequest, ReconstructionMethod};
use render::{LayerSelection, Lighting};
use scene::{Limits, MissingTextures, SceneSpec};

use crate::failures::cubes::{self, Crossing, met_wrongly, missed, noise, unit};
use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{foreground, not_held};
use crate::failures::shape::Shape;
use crate::failures::stage::looking;
use crate::failures::stand::{Stand, description, work};

const TOWN: &str = "urban";
const FOV_DEG: f32 = 45.0;
/// Lines along the town's longest edge, in the study and in tests: a view from afar shows the whole scene.
const TOWN_SIDES: [u32; 2] = [512, 256];
/// Directions from which a viewer walks in, around the upright axis.
const TURNS_DEG: [f32; 6] = [20.0, 80.0, 140.0, 200.0, 260.0, 320.0];
/// What a ray meets farther than this behind a surface is another one, in spacings.
const BEHIND: f32 = 4.0;
/// Lines along an edge of all other cubes.
const SIDE: u32 = 24;
const RAYS: u32 = 2000;
const LEAVES: u32 = 80;
/// Half sides of leaves that are not narrow.
const HALF_M: f32 = 3.0;
const HALF_LENGTH_M: f32 = 8.0;
const BLADES: u32 = 40;
const RAYS_A_BLADE: u32 = 60;
/// A ball between all lines, and the floor that it touches.
const BALL_IN_WORLD: Vec3 = Vec3::new(11.3, 9.6, 11.7);
const RADIUS_M: f32 = 8.0;
const FLOOR_M: f32 = BALL_IN_WORLD.y - RADIUS_M;
/// The height above the mirror at which the walk starts rays, in spacings. Along a slanting ray it starts at most four times as far.
const START_SPACINGS: f32 = 0.75;
const LEAST_RISE: f32 = 0.25;

pub const CURVES: [Curve; 4] = [
    Curve {
        name: "Errors against texels in the picture",
        subject: "a town, a layered depth cube, the viewer walks in",
        x: X::log("side of a texel", "px", &[0.14, 0.25, 0.5, 0.71, 1.0, 1.41, 2.0]),
        y: ["1 − SSIM of the foreground; surfaces not held", ""],
        series: &[
            Series::new("1 − SSIM", &[Shape::rises(0.05, 0.025)]),
            Series::new("not held", &[Shape::Bounded { least: 0.0, most: 0.06 }, Shape::Plateau { tolerance: 0.03 }]),
        ],
        why: "Silhouettes are those of squares, and colours are a texel apart: both grow in the picture. As many surfaces are lost from afar.",
        measure: by_texel,
    },
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
];

fn by_texel(stand: &Stand, sides_px: &[f64]) -> anyhow::Result<Rows> {
    let lighting = Lighting::default();
    let scene = TOWN.parse::<SceneSpec>()?.load(&Limits::default(), MissingTextures::Refuse)?;
    let on_device = stand.upload(&scene)?;
    let grid = CubeGrid::around(&scene.bounds(), TOWN_SIDES[usize::from(stand.is_small)])?;
    let renderer = &stand.engine().renderer;
    let [x, y, z] = [0, 1, 2]
        .map(|axis| renderer.draw_layers(work(&on_device, lighting), &grid.camera(axis), LayerSelection::Dominant));
    let description = description(&scene, lighting.highlight());
    let cube = CubeImages { grid, images: [x?, y?, z?], light_field: None };
    let set = stand.reconstructor().upload_cube(&cube, &description, Turn::default())?;
    rows(sides_px, |side_px| {
        let pixel_m = grid.spacing_m / side_px as f32;
        let cameras = TURNS_DEG.map(|turn_deg| towards_middle(stand, &scene.bounds(), pixel_m, turn_deg));
        let truths = stand.views(&on_device, lighting, &cameras, ViewPlanes::WITH_DEPTH)?;
        let request = ReconstructRequest::new(&set, &cameras, ReconstructionMethod::LAYERED);
        let planes = ViewPlanes::WITH_DEPTH;
        let views = stand.reconstructor().reconstruct(ReconstructRequest { planes, ..request })?;
        Ok([1.0 - foreground(&truths, &views)?.ssim, not_held(&truths, &views, BEHIND * grid.spacing_m)])
    })
}

/// A camera that looks at the middle of the scene, where a pixel has this side.
fn towards_middle(stand: &Stand, bounds: &Aabb, pixel_m: f32, turn_deg: f32) -> PinholeCamera {
    let focal_px = 0.5 * stand.view_px.y as f32 / (0.5 * FOV_DEG.to_radians()).tan();
    let from = Vec3::new(0.0, 0.5, 0.87).rotate_y(turn_deg.to_radians());
    looking(bounds.center() + from * (pixel_m * focal_px), bounds.center(), FOV_DEG, stand.view_px)
}

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
        let mut onto = Vec::new();
        let mut beside = Vec::new();
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
                onto.push(cubes::both(&twin, crossings, cubes::ray_to(leaf.at(place * half_m), from)));
                beside.push(cubes::both(&twin, crossings, cubes::ray_to(leaf.at(outside), from)));
            }
        }
        Ok([missed(onto), met_wrongly(beside)])
    })
}

fn by_layers(_: &Stand, counts: &[f64]) -> anyhow::Result<Rows> {
    let grid = cubes::grid(SIDE)?;
    let leaves: Vec<Leaf> = (0..LEAVES).map(|seed| Leaf::new(seed, 14.0, Vec2::splat(HALF_M))).collect();
    let crossings = |ray| leaves.iter().flat_map(|leaf| leaf.crossings(ray)).collect::<Vec<_>>();
    let images = [0, 1, 2].map(|axis| cubes::image(&grid, axis, crossings));
    rows(counts, |layers| {
        let twin = CubeTwin::new(&grid, &images.each_ref().map(|image| cut(image, layers as usize)));
        let rays = cubes::rays_around(Vec3::splat(0.5 * (SIDE - 1) as f32), 9.0, RAYS);
        Ok([missed(rays.map(|ray| cubes::both(&twin, crossings, ray)))])
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

/// Where a ray enters and leaves the ball.
fn ball(ray: Ray) -> Vec<Crossing> {
    let off = ray.origin_in_world - BALL_IN_WORLD;
    let towards = ray.direction_in_world;
    let [a, b, c] = [towards.length_squared(), off.dot(towards), off.length_squared() - RADIUS_M * RADIUS_M];
    if b * b <= a * c {
        return Vec::new();
    }
    let root = (b * b - a * c).max(0.0).sqrt();
    [(-b - root) / a, (-b + root) / a].map(|t| Crossing { t, normal_in_world: (off + towards * t) / RADIUS_M }).into()
}

fn by_distance(_: &Stand, distances: &[f64]) -> anyhow::Result<Rows> {
    let twin = cubes::cube(&cubes::grid(SIDE)?, ball);
    rows(distances, |distance| {
        let rays = (0..RAYS).map(|seed| {
            let [around, turn, rise] = noise(seed);
            let [off, along] =
                [around, turn].map(|turns| Vec3::Y.any_orthonormal_pair().0.rotate_y(std::f32::consts::TAU * turns));
            let origin_in_world = BALL_IN_WORLD.with_y(FLOOR_M) + off * distance as f32;
            let rise = 0.1 + 0.9 * rise;
            Ray { origin_in_world, direction_in_world: along * (1.0 - rise * rise).sqrt() + Vec3::Y * rise }
        });
        Ok([START_SPACINGS, 0.0].map(|above| {
            missed(rays.clone().map(|ray| {
                let near = above / ray.direction_in_world.y.max(LEAST_RISE);
                (cubes::nearest(ray, ball), twin.walk(ray, near).map(|hit| hit.t))
            }))
        }))
    })
}
