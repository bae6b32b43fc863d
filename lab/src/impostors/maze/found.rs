//! Which share of what a teapot mirrors is found in images of the maze.

use std::time::Instant;

use depth_image::{CubeGrid, Environment, ProvenanceKind, Ray};
use gpu::Turn;
use rayon::prelude::*;
use reconstruction::RayWork;
use reconstruction::scalar::CubeTwin;
use render::{LayerSelection, Lighting, SamplePlanes};

use super::cameras::{self, NESTED_PX};
use super::subject::{MirroredRay, NEAR_M, Subject};
use crate::failures::stage::in_the_dark;
use crate::failures::stand::work;
use crate::graph::{GraphCamera, GraphImage, GraphSearch};
use crate::study::Column;

/// The paper's coarse step, and its longest fine one.
pub const SEARCH: GraphSearch = GraphSearch { coarse_px: 6.0, fine_px: 1.0 };
/// Ends within this share of the maze's side are right.
const RIGHT: f32 = 0.01;
/// Lines along the side of a first cube, by whose samples that of equal texels is chosen.
const FIRST_SIDE: u32 = 64;
/// The twin of the walk in a cube compares each ray with all samples.
const CUBE_RAYS: usize = 1000;

pub const NESTED: &str = "graph, nested";
pub const APART: &str = "graph, apart";
pub const PINHOLES: &str = "four pinholes from above";
pub const CUBE: &str = "layered cube";

/// What images tell of the rays off the teapot.
pub struct Found {
    pub scene: String,
    pub images: &'static str,
    pub texels: usize,
    pub rays: usize,
    pub found_ratio: f64,
    /// Ends elsewhere.
    pub wrong_ratio: f64,
    /// Of graph images on the host, of pinholes on the device.
    pub ns_per_ray: Option<f64>,
    pub steps_per_ray: Option<f64>,
}

pub const TITLE: &str = "Rays off the teapot at 29 places in a maze, and the share whose ends are found";
pub const COLUMNS: [Column<Found>; 8] = [
    Column::new("scene", |row| row.scene.as_str().into()),
    Column::new("images", |row| row.images.into()),
    Column::new("texels", |row| row.texels.into()),
    Column::new("rays", |row| row.rays.into()),
    Column::with_unit("found", "%", |row| (row.found_ratio * 100.0).into()),
    Column::with_unit("wrong", "%", |row| (row.wrong_ratio * 100.0).into()),
    Column::with_unit("a ray", "ns", |row| row.ns_per_ray.into()),
    Column::new("steps a ray", |row| row.steps_per_ray.into()),
];

/// All kinds of images of one maze.
///
/// # Errors
/// The device fails, or no ray meets the maze.
pub fn compare(subject: &Subject<'_>, rays: &[MirroredRay]) -> anyhow::Result<Vec<Found>> {
    anyhow::ensure!(!rays.is_empty(), "no ray meets {}", subject.name());
    let nested = in_graph(subject, NESTED, &cameras::nested(&subject.maze)?, rays);
    let apart = in_graph(subject, APART, &cameras::apart(&subject.maze)?, rays);
    Ok(vec![nested, apart, in_pinholes(subject, rays)?, in_cube(subject, rays)?])
}

fn in_graph(subject: &Subject<'_>, images: &'static str, camera: &GraphCamera, rays: &[MirroredRay]) -> Found {
    let image = GraphImage::take(camera, |ray, span| subject.meet(ray, span));
    let cost = search_cost(&image, rays, SEARCH);
    Found {
        texels: camera.texels(),
        ns_per_ray: Some(cost.ns_per_ray),
        steps_per_ray: Some(cost.steps_per_ray),
        ..found(subject, images, rays, &cost.ways_m)
    }
}

/// A search of all rays.
pub struct SearchCost {
    pub ns_per_ray: f64,
    pub steps_per_ray: f64,
    pub ways_m: Vec<Option<f32>>,
}

pub fn search_cost(image: &GraphImage<'_>, rays: &[MirroredRay], search: GraphSearch) -> SearchCost {
    let start = Instant::now();
    let ends: Vec<_> = rays.par_iter().map(|mirrored| image.follow(&mirrored.ray, f64::from(NEAR_M), search)).collect();
    let duration_s = start.elapsed().as_secs_f64();
    let steps: u64 = ends.iter().map(|end| u64::from(end.steps)).sum();
    SearchCost {
        ns_per_ray: duration_s * 1e9 / rays.len() as f64,
        steps_per_ray: steps as f64 / rays.len() as f64,
        ways_m: ends.iter().map(|end| end.met.map(|hit| hit.way_m as f32)).collect(),
    }
}

fn in_pinholes(subject: &Subject<'_>, mirrored: &[MirroredRay]) -> anyhow::Result<Found> {
    let cameras = cameras::above(&subject.maze);
    let images = subject.stand.images(&subject.on_device, Lighting::UNLIT, &cameras, SamplePlanes::default())?;
    let description = in_the_dark(subject.scene.bounds(), Environment::uniform(glam::Vec3::ZERO));
    let set = subject.stand.reconstructor().upload(&images, &description, Turn::default())?;
    let rays: Vec<Ray> = mirrored.iter().map(|mirrored| mirrored.ray).collect();
    let work = RayWork::new(&set, NEAR_M);
    // The first use of a shader builds it.
    subject.stand.reconstructor().follow(work, &rays)?;
    let (ends, duration_s) = subject.stand.reconstructor().follow(work, &rays)?;
    let ways_m: Vec<Option<f32>> =
        ends.iter().map(|end| (end.kind == ProvenanceKind::Hit).then_some(end.way_m)).collect();
    Ok(Found {
        texels: images.iter().map(|image| image.camera.pixel_count()).sum(),
        ns_per_ray: Some(duration_s * 1e9 / rays.len() as f64),
        ..found(subject, PINHOLES, mirrored, &ways_m)
    })
}

/// The twin of the product's walk, for some of the rays.
fn in_cube(subject: &Subject<'_>, rays: &[MirroredRay]) -> anyhow::Result<Found> {
    let first = cube_of(subject, FIRST_SIDE)?;
    let scale = (f64::from(NESTED_PX.element_product()) / first.samples as f64).sqrt();
    let cube = cube_of(subject, (f64::from(FIRST_SIDE) * scale) as u32)?;
    let step = rays.len().div_ceil(CUBE_RAYS);
    let some: Vec<MirroredRay> = rays.iter().step_by(step).copied().collect();
    let walks = some.par_iter().map(|mirrored| cube.twin.walk(mirrored.ray, NEAR_M).map(|hit| hit.t));
    let ways_m: Vec<Option<f32>> = walks.collect();
    Ok(Found { texels: cube.samples, ..found(subject, CUBE, &some, &ways_m) })
}

struct Cube {
    twin: CubeTwin,
    samples: usize,
}

fn cube_of(subject: &Subject<'_>, side: u32) -> anyhow::Result<Cube> {
    let grid = CubeGrid::around(&subject.scene.bounds(), side)?;
    let renderer = &subject.stand.engine().renderer;
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let work = work(&subject.on_device, Lighting::UNLIT);
        renderer.draw_layers(work, &grid.camera(axis), LayerSelection::Dominant)
    });
    let images = [x?, y?, z?];
    let samples = images.iter().map(|image| image.sample_count()).sum();
    Ok(Cube { twin: CubeTwin::new(&grid, &images), samples })
}

fn found(subject: &Subject<'_>, images: &'static str, rays: &[MirroredRay], ways_m: &[Option<f32>]) -> Found {
    let tolerance_m = RIGHT * subject.scene.bounds().size().max_element();
    let hits = ways_m.iter().flatten().count();
    let pairs = rays.iter().zip(ways_m);
    let errors_m = pairs.filter_map(|(mirrored, way_m)| way_m.map(|way_m| (way_m - mirrored.way_m).abs()));
    let right = errors_m.filter(|error_m| *error_m <= tolerance_m).count();
    let count = rays.len() as f64;
    Found {
        scene: subject.name(),
        images,
        texels: 0,
        rays: rays.len(),
        found_ratio: right as f64 / count,
        wrong_ratio: (hits - right) as f64 / count,
        ns_per_ray: None,
        steps_per_ray: None,
    }
}
