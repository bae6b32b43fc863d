//! Quads of samples: grazing normals, isolated samples, holes, and room behind a surface.

use depth_image::{BACKGROUND_INVERSE_DEPTH, DepthImage, HOLE_INVERSE_DEPTH, ProvenanceKind, oct16_from_unit};
use fixtures::quad;
use glam::{UVec2, Vec3};
use scene::procedural::tree_terrain;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::measures::{found, is_kind, share};
use crate::failures::shape::Shape;
use crate::failures::stage::{CARVE, Cell, HYBRID, MESH, Stage, looking, search};
use crate::failures::stand::Stand;

const TREE: Cell = Cell { eye: Vec3::new(0.3, 2.2, 2.2), target: Vec3::new(0.0, 0.3, 0.0), half_m: 0.3 };
const COLOR: [u8; 3] = [200, 120, 60];
/// The distance of a wall.
const WALL_M: f32 = 3.0;
const ALL: &[Shape] = &[Shape::Bounded { least: 0.999, most: 1.0 }];

pub const CURVES: [Curve; 4] = [
    Curve {
        name: "Stretch of quads against the normal",
        subject: "a wall whose corners are unknown, its normals turned from the eye",
        x: X::linear("angle of normal and ray", "°", &[0.0, 45.0, 80.0, 85.0, 87.5, 89.0, 89.9, 89.99, 90.0]),
        y: ["greatest stretch of depth", "%"],
        series: &[
            Series::new("in the middle", &[Shape::rises(10.0, 0.1)]),
            Series::new("anywhere", &[Shape::Bounded { least: 0.0, most: 100.1 }]),
        ],
        why: "A plane along a texel's ray reaches to infinity: the slope of a quad is bounded.",
        measure: by_normal,
    },
    Curve {
        name: "Isolated samples shown against their distance",
        subject: "every nth sample of a wall, seen from its own camera",
        x: X::linear("distance of samples", "texels", &[1.0, 2.0, 3.0, 4.0, 6.0]),
        y: ["samples shown", ""],
        series: &[
            Series::new("mesh", &[Shape::falls(0.8, 0.0), Shape::EqualAt { x: 2.0, y: 0.0, tolerance: 0.0 }]),
            Series::new("hybrid_mesh", ALL),
        ],
        why: "A quad between four samples needs all four; a quad of a sample needs none but itself.",
        measure: by_distance,
    },
    Curve {
        name: "Surfaces shown against holes",
        subject: "a tree over a terrain, three images with random holes",
        x: X::linear("holes", "%", &[0.0, 10.0, 20.0, 30.0, 45.0, 60.0]).with_small(&[0.0, 10.0, 30.0, 60.0]),
        y: ["pixels with a surface that are hits", ""],
        series: &[
            Series::new("mesh", &[Shape::falls(0.2, 0.02)]),
            Series::new("hybrid_mesh", &[Shape::falls(0.01, 0.02), Shape::Bounded { least: 0.5, most: 1.0 }]),
        ],
        why: "One hole takes four quads of a mesh away, and one of a hybrid mesh.",
        measure: by_holes,
    },
    Curve {
        name: "A surface on the volume's face",
        subject: "a wall, four images, the volume padded",
        x: X::linear("room behind the wall", "m", &[0.0, 0.01, 0.03, 0.1, 0.3]),
        y: ["pixels of the wall found", ""],
        series: &[
            Series::new("light_field_search:64", &[Shape::Bounded { least: 0.95, most: 1.0 }]),
            Series::new("joint_carve", &[Shape::Bounded { least: 0.97, most: 1.0 }]),
        ],
        why: "The search meets a surface behind its samples' stairs, and the carve half a code behind it: the volume's own padding must suffice for both.",
        measure: by_room,
    },
];

fn by_normal(stand: &Stand, angles_deg: &[f64]) -> anyhow::Result<Rows> {
    let camera = looking(Vec3::Z * WALL_M, Vec3::ZERO, 45.0, UVec2::splat(72));
    let mut stage = Stage::with_corners(stand, &quad(Vec3::ZERO, 4.0, Vec3::Z, COLOR), &[camera])?;
    stage.images[0].corner_inverse_depth_per_m.iter_mut().for_each(|corners| corners.fill(HOLE_INVERSE_DEPTH));
    rows(angles_deg, |angle_deg| {
        let (sin, cos) = (angle_deg as f32).to_radians().sin_cos();
        let normal = oct16_from_unit(Vec3::new(sin, 0.0, cos));
        stage.images[0].normal_oct16.iter_mut().for_each(|normals| normals.fill(normal));
        let quads = stand.reconstructor().read_quads(&stage.set()?, HYBRID)?;
        let stretch = |point: &Vec3| {
            let depth_m = (*point - camera.eye_in_world).dot(camera.forward_in_world());
            // A corner behind the eye has no stretch.
            let ratio = if depth_m > 0.0 { (depth_m / WALL_M).max(WALL_M / depth_m) } else { f32::NAN };
            100.0 * f64::from(ratio - 1.0)
        };
        let greatest = |corners: &mut dyn Iterator<Item = &Vec3>| {
            // `f64::max` would hide what is no number.
            corners.map(stretch).fold(
                0.0,
                |most: f64, stretch| {
                    if most.is_nan() || stretch <= most { most } else { stretch }
                },
            )
        };
        let middle = &quads[36 * 72 + 36];
        let anywhere = greatest(&mut quads.iter().flat_map(|quad| &quad.corners_in_world));
        let all = if quads.len() == camera.pixel_count() { anywhere } else { f64::NAN };
        Ok([greatest(&mut middle.corners_in_world.iter()), all])
    })
}

fn by_distance(stand: &Stand, distances: &[f64]) -> anyhow::Result<Rows> {
    let camera = looking(Vec3::Z * WALL_M, Vec3::ZERO, 45.0, stand.sample_px);
    let whole = Stage::with_corners(stand, &quad(Vec3::ZERO, 2.0, Vec3::Z, COLOR), &[camera])?;
    rows(distances, |distance| {
        let image = isolated(&whole.images[0], distance as usize);
        let mut shown = [0.0; 2];
        for (shown, method) in shown.iter_mut().zip([MESH, HYBRID]) {
            let view = whole.views_of(std::slice::from_ref(&image), whole.volume, &[camera], method)?.remove(0);
            let hits = image.inverse_depth_per_m.iter().zip(is_kind(&view, ProvenanceKind::Hit));
            *shown = share(hits.filter(|(depth, _)| **depth > 0.0).map(|(_, hit)| hit));
        }
        Ok(shown)
    })
}

/// Every nth sample alone, the rest background, and no corner known. Those along the border have no neighbours and stay
/// out.
fn isolated(image: &DepthImage, distance: usize) -> DepthImage {
    let mut image = image.clone();
    let [width, height] = image.size_px().to_array().map(|side| side as usize);
    for (index, depth) in image.inverse_depth_per_m.iter_mut().enumerate() {
        let (x, y) = (index % width, index / width);
        let is_inside = x > 0 && y > 0 && x + 1 < width && y + 1 < height;
        *depth = if is_inside && x % distance == 0 && y % distance == 0 { *depth } else { BACKGROUND_INVERSE_DEPTH };
    }
    image.corner_inverse_depth_per_m.iter_mut().for_each(|corners| corners.fill(BACKGROUND_INVERSE_DEPTH));
    image
}

fn by_holes(stand: &Stand, percents: &[f64]) -> anyhow::Result<Rows> {
    let stage = Stage::with_corners(stand, &tree_terrain(2000, 1), &TREE.samples(3, stand.sample_px))?;
    let cameras = TREE.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    rows(percents, |percent| {
        let mut state = 1u32;
        let images: Vec<DepthImage> =
            stage.images.iter().map(|image| holed(image, percent / 100.0, &mut state)).collect();
        let shown =
            |method| Ok::<_, anyhow::Error>(found(&truths, &stage.views_of(&images, stage.volume, &cameras, method)?));
        Ok([shown(MESH)?, shown(HYBRID)?])
    })
}

/// Without some samples, the same ones each time. More holes take away the samples that fewer took, too.
fn holed(image: &DepthImage, share: f64, state: &mut u32) -> DepthImage {
    let mut image = image.clone();
    for depth in &mut image.inverse_depth_per_m {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *depth = if f64::from(*state >> 8) < share * f64::from(1 << 24) { HOLE_INVERSE_DEPTH } else { *depth };
    }
    image
}

fn by_room(stand: &Stand, margins_m: &[f64]) -> anyhow::Result<Rows> {
    let cell = Cell { eye: Vec3::Z * 4.0, target: Vec3::ZERO, half_m: 0.5 };
    let stage = Stage::new(stand, &quad(Vec3::ZERO, 1.0, Vec3::Z, COLOR), &cell.samples(4, stand.sample_px))?;
    let cameras = cell.views(stand.view_px);
    let truths = stage.truth(&cameras)?;
    rows(margins_m, |margin_m| {
        let volume = stage.volume.padded(margin_m as f32);
        let shown =
            |method| Ok::<_, anyhow::Error>(found(&truths, &stage.views_of(&stage.images, volume, &cameras, method)?));
        Ok([shown(search(64))?, shown(CARVE)?])
    })
}
