//! The cost of slices: views whole and cut, in turn, on an otherwise idle device (docs/device.md, "Sharing the device").
//! Arguments name what is measured: reconstruction methods, or `direct`.

use std::time::Instant;

use depth_image::{Camera, PinholeCamera, ViewPlanes};
use engine::GpuEngine;
use glam::{UVec2, Vec3};
use gpu::{DevicePreference, Turn};
use reconstruction::{METHODS, ReconstructRequest, SetDescription};
use render::{DrawWork, GpuScene, Refinement, SamplePlanes, Visibility};

const RUNS: usize = 5;
const VIEW_PX: UVec2 = UVec2::new(1280, 720);
const LIGHTING: &str = "soft 4, occlusion 4";

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Outcome<()> {
    let engine = GpuEngine::open(DevicePreference::Any)?;
    let renderer = &engine.renderer;
    let reconstructor = &engine.reconstructor;
    println!("{}: views of {VIEW_PX}, {LIGHTING}, medians of {RUNS}", renderer.gpu().name());
    let scene = scene::procedural::tree_terrain(500_000, 1);
    let bounds = scene.bounds();
    let middle = (bounds.min + bounds.max) / 2.0;
    let size_m = bounds.size().max_element();
    let camera = |x: f32, size_px| {
        let eye = middle + Vec3::new(x, 0.3, 1.0) * size_m * 0.5;
        PinholeCamera::looking_at(eye, middle, Vec3::Y, 0.9, size_px)
    };
    let on_device = GpuScene::upload(renderer.gpu(), &scene)?;
    let draw = |lighting: &str| -> Outcome<DrawWork<'_>> {
        let visibility = Visibility::Measured;
        let refinement = Refinement::default();
        let turn = Turn::default();
        let lighting = lighting.parse()?;
        Ok(DrawWork { visibility, refinement, turn, ..DrawWork::new(&on_device, lighting) })
    };
    let planes = SamplePlanes { normal: true, corners: true, ..SamplePlanes::default() };
    let samples = [-0.2, -0.05, 0.05, 0.2].map(|x| Camera::Pinhole(camera(x, UVec2::new(640, 480))));
    let images = renderer.draw_depth_images(draw("phong")?, &samples, planes)?;
    let background = scene.background;
    let illumination = &scene.illumination;
    let set =
        SetDescription { volume: bounds, background, illumination, highlight: None, environment: None, mips: false };
    let set = reconstructor.upload(&images, &set, Turn::default())?;
    let view = [camera(0.0, VIEW_PX)];
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let is_asked = |name: &str| asked.is_empty() || asked.iter().any(|asked| asked == name);
    for row in METHODS.iter().filter(|row| is_asked(row.name)) {
        let make = || reconstructor.reconstruct(ReconstructRequest::new(&set, &view, row.method));
        compare(&engine, row.name, || Ok(make().map(drop)?))?;
    }
    if !is_asked("direct") {
        return Ok(());
    }
    let lit = draw(LIGHTING)?;
    compare(&engine, "direct", || Ok(renderer.draw_views(lit, &view, ViewPlanes::default()).map(drop)?))
}

/// Prints the median times of work that is whole and of work that is cut.
fn compare(engine: &GpuEngine, what: &str, work: impl Fn() -> Outcome<()>) -> Outcome<()> {
    let queue = &engine.renderer.gpu().device_queue;
    let mut seconds = [Vec::new(), Vec::new()];
    let mut slices = 0;
    // The first runs of both kinds build pipelines and learn rates.
    for run in 0..2 * (RUNS + 2) {
        let is_cut = run % 2 == 1;
        let live = is_cut.then(|| queue.live_stream());
        let start = Instant::now();
        let before = queue.slices();
        work()?;
        if run >= 4 {
            seconds[usize::from(is_cut)].push(start.elapsed().as_secs_f64());
        }
        slices = queue.slices() - before;
        drop(live);
    }
    let [whole_s, cut_s] = seconds.map(|mut seconds| {
        seconds.sort_by(f64::total_cmp);
        seconds[seconds.len() / 2]
    });
    let whole_ms = whole_s * 1e3;
    let cut_ms = cut_s * 1e3;
    let slice_ms = cut_ms / slices.max(1) as f64;
    println!(
        "{what}: whole {whole_ms:.1} ms, cut {cut_ms:.1} ms ({:+.1} %), {slices} slices of {slice_ms:.1} ms",
        100.0 * (cut_s / whole_s - 1.0)
    );
    Ok(())
}
