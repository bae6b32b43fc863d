//! Rays a second by kind, how far from the memory's limit they are, the tree they go through, and whether surfaces
//! are found the quicker way.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::setup::Setup;
use depth_image::{Camera, DepthImage, Light, PinholeCamera, ViewPlanes, unit_from_oct16};
use engine::GpuEngine;
use glam::{UVec2, Vec3};
use node::Engine as _;
use render::{Choice, DrawWork, GpuScene, Lighting, Refinement, SamplePlanes, Visibility};
use study::{Bar, Cell, Check, Report, Table};

use super::BenchArgs;
use super::timing::in_turn;
use crate::evaluate::median;

/// Of every time; the median counts.
const RUNS: usize = 3;
/// Rays a pixel and lamp, and of occlusion a pixel, as in the lightings below.
const MANY: usize = 16;
const NODE_BYTES: f64 = 80.0;
const TRIANGLE_BYTES: f64 = 48.0;
/// Sizes of pictures for which the way that surfaces are found is looked at.
const SIZES_PX: [UVec2; 3] = [UVec2::new(200, 150), UVec2::new(400, 300), UVec2::new(800, 600)];

/// The lightings that are timed, by their places in [`Kind`].
const LIGHTINGS: [&str; 5] = ["unlit", "phong", "shadows", "soft 16", "phong, occlusion 16"];

/// Rays of one kind: what they take is one lighting's time less that of another without them.
struct Kind {
    name: &'static str,
    with: usize,
    without: Option<usize>,
    count: fn(&Counts) -> usize,
}

const KINDS: [Kind; 4] = [
    Kind { name: "primary", with: 0, without: None, count: |counts| counts.pixels },
    Kind { name: "shadow", with: 2, without: Some(1), count: |counts| counts.lamps_faced },
    Kind { name: "soft shadow", with: 3, without: Some(1), count: |counts| counts.lamps_faced * MANY },
    Kind { name: "occlusion", with: 4, without: Some(1), count: |counts| counts.surfaces * MANY },
];

/// What rays begin at.
#[derive(Default)]
struct Counts {
    pixels: usize,
    /// Pixels that show one.
    surfaces: usize,
    /// Lamps whose light reaches a surface's front from their middle, over all surfaces.
    lamps_faced: usize,
}

/// What all parts draw.
struct Subject<'a> {
    engine: &'a GpuEngine,
    scene: &'a GpuScene,
    cameras: &'a [PinholeCamera],
}

/// Adds tables and checks.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, setup: &Setup, report: &mut Report) -> anyhow::Result<()> {
    let scene = engine.scene(setup.offer.hash.as_str())?;
    let cameras = &setup.samples[..setup.samples.len().min(if args.quick { 1 } else { 4 })];
    let subject = Subject { engine, scene: &scene, cameras };
    report.tables.push(tree(&subject)?);
    let primary_a_second = speeds(&subject, &setup.scene.illumination.lights, report)?;
    beside_memory(&subject, primary_a_second, report)?;
    choices(&subject, setup.offer.hash.as_str(), report)
}

impl Subject<'_> {
    fn work(&self, lighting: Lighting, visibility: Visibility) -> DrawWork<'_> {
        DrawWork { scene: self.scene, lighting, scene_time_s: 0.0, visibility, refinement: Refinement::default() }
    }

    fn draw(&self, lighting: Lighting, planes: SamplePlanes) -> anyhow::Result<Vec<DepthImage>> {
        let cameras: Vec<Camera> = self.cameras.iter().copied().map(Camera::Pinhole).collect();
        Ok(self.engine.renderer().draw_depth_images(self.work(lighting, Visibility::Rays), &cameras, planes)?)
    }

    fn camera(&self) -> anyhow::Result<&PinholeCamera> {
        self.cameras.first().context("no sample cameras")
    }

    /// What speeds are given for: a core where shaders run on the processor.
    fn workers(&self) -> (&'static str, f64) {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from) as f64;
        if self.engine.is_software() { ("a core", cores()) } else { ("the device", 1.0) }
    }
}

const TREE: [(&str, &str); 6] = [
    ("triangles", ""),
    ("built in", "s"),
    ("uploaded in", "s"),
    ("nodes", ""),
    ("levels", ""),
    ("expected visits and tests of a random ray", ""),
];

fn tree(subject: &Subject<'_>) -> anyhow::Result<Table> {
    let mut table = Table::new("Tree over the triangles", &TREE);
    let built = subject.scene.acceleration(0.0)?;
    let (build_s, upload_s) = (built.build_s.into(), built.upload_s.into());
    table.push([
        built.triangles.into(),
        build_s,
        upload_s,
        built.nodes.into(),
        built.depth.into(),
        built.cost.into(),
    ])?;
    Ok(table)
}

const SPEEDS: [(&str, &str); 7] = [
    ("rays", ""),
    ("lighting", ""),
    ("less the time of", ""),
    ("traced", "million"),
    ("time", "ms"),
    ("speed of", ""),
    ("speed", "million rays/s"),
];

/// Adds the table; gives primary rays a second on the whole device.
fn speeds(subject: &Subject<'_>, lamps: &[Light], report: &mut Report) -> anyhow::Result<f64> {
    let lightings = LIGHTINGS.map(str::parse::<Lighting>).into_iter().collect::<Result<Vec<_>, _>>()?;
    let draw = |lighting| subject.draw(lighting, SamplePlanes::default()).map(drop);
    let seconds = in_turn(&lightings, RUNS, draw)?;
    let normals = SamplePlanes { normal: true, ..SamplePlanes::default() };
    let counts = Counts::of(&subject.draw(Lighting::UNLIT, normals)?, lamps);
    let mut table = Table::new(speeds_name(subject), &SPEEDS);
    for kind in &KINDS {
        table.push(kind.row(&counts, &seconds, subject.workers()))?;
    }
    report.tables.push(table);
    Ok(counts.pixels as f64 / KINDS[0].seconds(&seconds))
}

fn speeds_name(subject: &Subject<'_>) -> String {
    let size = subject.cameras.first().map_or(UVec2::ZERO, |camera| camera.size_px);
    let images = subject.cameras.len();
    format!("Rays, depth images of {}x{}: {images} (primary with all that is written and read back)", size.x, size.y)
}

impl Kind {
    fn seconds(&self, of_lightings: &[f64]) -> f64 {
        of_lightings[self.with] - self.without.map_or(0.0, |place| of_lightings[place])
    }

    fn row(&self, counts: &Counts, of_lightings: &[f64], (of, workers): (&str, f64)) -> [Cell; 7] {
        let (rays, seconds) = ((self.count)(counts) as f64, self.seconds(of_lightings));
        [
            self.name.into(),
            LIGHTINGS[self.with].into(),
            self.without.map(|place| LIGHTINGS[place]).into(),
            (rays * 1e-6).into(),
            (seconds * 1e3).into(),
            of.into(),
            (rays / seconds / workers * 1e-6).into(),
        ]
    }
}

impl Counts {
    fn of(images: &[DepthImage], lamps: &[Light]) -> Self {
        let mut counts = Self::default();
        for image in images {
            let size = image.size_px();
            counts.pixels += size.element_product() as usize;
            for (x, y) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))) {
                let Some(point) = image.sample_in_world(x, y) else { continue };
                let normal =
                    image.normal_oct16.as_ref().map_or(Vec3::ZERO, |n| unit_from_oct16(n[(y * size.x + x) as usize]));
                counts.surfaces += 1;
                counts.lamps_faced += lamps.iter().filter(|lamp| faces(lamp, point, normal)).count();
            }
        }
        counts
    }
}

fn faces(lamp: &Light, point_in_world: Vec3, normal_in_world: Vec3) -> bool {
    let incident = lamp.from_middle(point_in_world);
    normal_in_world.dot(incident.towards_light_in_world) > 0.0 && incident.irradiance_linear.max_element() > 0.0
}

const BESIDE_MEMORY: [(&str, &str); 7] = [
    ("node visits a ray", ""),
    ("triangle tests a ray", ""),
    ("a ray reads", "bytes"),
    ("rays read", "GB/s"),
    ("tree and triangles", "MB"),
    ("read once", "GB/s"),
    ("share of it", "%"),
];

/// What primary rays read, beside a pass that reads all there is once.
fn beside_memory(subject: &Subject<'_>, rays_a_second: f64, report: &mut Report) -> anyhow::Result<()> {
    let renderer = subject.engine.renderer();
    let work = subject.work(Lighting::UNLIT, Visibility::Rays);
    let visits = renderer.count_visits(work, subject.camera()?)?.of_pixel;
    let mean = |of: usize| visits.iter().map(|pair| f64::from(pair[of])).sum::<f64>() / visits.len() as f64;
    let (nodes, tests) = (mean(0), mean(1));
    let bytes_a_ray = nodes * NODE_BYTES + tests * TRIANGLE_BYTES;
    let by_rays = bytes_a_ray * rays_a_second;
    let (bytes, bytes_a_second) = plain_reading(subject)?;
    let mut table = Table::new("Primary rays beside plain reading of nodes and triangles", &BESIDE_MEMORY);
    let read = [by_rays * 1e-9, bytes * 1e-6, bytes_a_second * 1e-9, by_rays / bytes_a_second * 100.0];
    table.push([nodes, tests, bytes_a_ray].into_iter().chain(read).map(Into::into))?;
    report.tables.push(table);
    let least = visits.iter().map(|pair| pair[0]).min().map_or(f64::NAN, f64::from);
    report.checks.push(Check::new("node visits of a primary ray, the least", least, "", Bar::AtLeast(1.0)));
    Ok(())
}

/// Bytes of tree and triangles, and how many of them a second.
fn plain_reading(subject: &Subject<'_>) -> anyhow::Result<(f64, f64)> {
    let pass = |_| subject.engine.renderer().read_acceleration(subject.scene, 0.0);
    let passes = (0..RUNS).map(pass).collect::<Result<Vec<_>, _>>()?;
    let bytes = passes.first().map_or(f64::NAN, |pass| pass.bytes as f64);
    Ok((bytes, bytes / median(passes.iter().map(|pass| pass.device_s).collect())))
}

const CHOICES: [(&str, &str); 7] = [
    ("picture", ""),
    ("by triangles", "ms"),
    ("by rays", "ms"),
    ("chosen", ""),
    ("again by triangles", "ms"),
    ("again by rays", "ms"),
    ("chosen over other", "×"),
];

/// How surfaces are found in pictures of some sizes, and what both ways take when they are timed again.
fn choices(subject: &Subject<'_>, hash: &str, report: &mut Report) -> anyhow::Result<()> {
    let mut table = Table::new("How surfaces are found, one view unlit", &CHOICES);
    let mut worst = 0f64;
    for size_px in SIZES_PX {
        let camera = resized(subject.camera()?, size_px);
        let choice = subject.engine.visibility_choice(hash, &camera)?;
        let again = again(subject, &camera)?;
        worst = worst.max(chosen_over_other(&choice, &again));
        table.push(choice_row(size_px, &choice, &again))?;
    }
    report.tables.push(table);
    let name = "surfaces: time of the chosen way over the other, worst size";
    report.checks.push(Check::new(name, worst, "×", Bar::AtMost(1.0)));
    Ok(())
}

fn choice_row(size_px: UVec2, choice: &Choice, again: &Choice) -> [Cell; 7] {
    let chosen = if choice.rays_are_faster() { Visibility::Rays } else { Visibility::Triangles };
    let ms = |s: f64| Cell::from(s * 1e3);
    [
        format!("{}x{}", size_px.x, size_px.y).into(),
        ms(choice.triangles_s),
        ms(choice.rays_s),
        chosen.to_string().into(),
        ms(again.triangles_s),
        ms(again.rays_s),
        chosen_over_other(choice, again).into(),
    ]
}

fn chosen_over_other(choice: &Choice, again: &Choice) -> f64 {
    let rays_over_triangles = again.rays_s / again.triangles_s;
    if choice.rays_are_faster() { rays_over_triangles } else { rays_over_triangles.recip() }
}

/// Both ways in turn.
fn again(subject: &Subject<'_>, camera: &PinholeCamera) -> anyhow::Result<Choice> {
    let draw = |visibility| {
        let work = subject.work(Lighting::UNLIT, visibility);
        subject.engine.renderer().draw_views(work, &[*camera], ViewPlanes::default())?;
        Ok(())
    };
    let seconds = in_turn(&[Visibility::Triangles, Visibility::Rays], RUNS, draw)?;
    Ok(Choice { triangles_s: seconds[0], rays_s: seconds[1] })
}

/// The same field of view in another size.
pub fn resized(camera: &PinholeCamera, size_px: UVec2) -> PinholeCamera {
    let scale = size_px.as_vec2() / camera.size_px.as_vec2();
    PinholeCamera { size_px, focal_px: camera.focal_px * scale, principal_px: camera.principal_px * scale, ..*camera }
}
