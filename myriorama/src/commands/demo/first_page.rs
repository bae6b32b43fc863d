//! The first page: one view with shared light, beside direct drawing in the same time.

use std::num::NonZeroU32;
use std::path::Path;
use std::time::Instant;

use anyhow::Context as _;
use app_core::print_line;
use app_core::setup::{SceneArgs, Setup};
use cluster::Workload;
use depth_image::{Antialias, PinholeCamera, View, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use image::RgbImage;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use metrics::{PictureErrors, flip_map};
use node::{DirectWork, Engine as _, SampleSet, SampleWork, Turn, ViewWork, WorkClass};
use render::Lighting;
use report::Picture;

use super::args::DemoArgs;
use super::page_layout::{self, TitledPicture, VIEW_PX};
use super::viewpoint::Viewpoint;

/// The side of sample images over that of the view, unless the user names a size: light needs no more.
const DENSITY: f32 = 0.5;
const SAMPLES_A_PIXEL: u32 = 4;
const TURN: Turn = Turn::of(WorkClass::Batch);
/// The size of the view that is drawn before the timed one.
const WARM_UP_PX: UVec2 = UVec2::new(32, 20);

/// Makes the page of a scene and writes it as `first-page.png` to `args.out`.
///
/// # Errors
/// The samples are no depth images, the device fails, or the folder cannot be written.
pub(super) fn write(args: &DemoArgs, page_scene: &SceneArgs, setup: Setup) -> anyhow::Result<Picture> {
    setup.check_depth_images()?;
    let viewpoint = Viewpoint::of(&page_scene.scene, &setup)?;
    let camera = viewpoint.camera(VIEW_PX.into());
    let denser_px = (camera.size_px.as_vec2() * DENSITY).as_uvec2();
    let around = viewpoint.samples(page_scene.sample_size.fixed_px().unwrap_or(denser_px));
    let samples = page_scene.sampling().cameras(around.clone());
    let setup = Setup { around, samples, ..setup };
    let views = PageViews::make(args, page_scene, &setup, camera)?;
    let picture = page(&setup, &views)?;
    let path = args.out.join("first-page.png");
    save(&picture, &path).with_context(|| path.display().to_string())?;
    print_line!("first page: {}", path.display());
    Ok(picture)
}

fn save(picture: &Picture, path: &Path) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
    Ok(picture.image.write_with_encoder(encoder)?)
}

/// A view and its time on an idle device.
struct TimedView {
    view: View,
    seconds: f64,
    lighting: Lighting,
}

/// The view of the page.
struct PageViews {
    /// Made from samples.
    shared: TimedView,
    /// Whether samples give the view their light, and the scene its surfaces.
    shares_light: bool,
    /// Drawn directly in about the same time, with fewer rays.
    hurried: TimedView,
    /// Drawn directly with all rays.
    reference: TimedView,
    /// The time of all sample images.
    samples_s: f64,
}

impl PageViews {
    fn make(args: &DemoArgs, page_scene: &SceneArgs, setup: &Setup, camera: PinholeCamera) -> anyhow::Result<Self> {
        // A device of its own: the page's views are far larger than the others, and so are their buffers.
        let engine = GpuEngine::shared(args.device.device)?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        let antialias = Antialias::of(SAMPLES_A_PIXEL).context("four samples are offered")?;
        let planes = ViewPlanes { antialias, ..ViewPlanes::WITH_DEPTH };
        let lighting = page_scene.lighting;
        let method = page_scene.method_in(lighting);
        let workload = setup.workload(page_scene.sampling(), lighting, &setup.samples);
        let workload = Workload { planes: engine.sample_planes(&method)?, ..workload };
        let (images, samples_s) = timed(|| Ok(engine.sample(&SampleWork::of(&workload), TURN)?))?;
        let set = engine.upload(&SampleSet::of(&workload, images, false)?, TURN)?;
        let view_work = ViewWork { cameras: vec![camera], method, planes };
        // The first view of a size also makes its buffers and shaders.
        engine.reconstruct(set.as_ref(), &view_work, TURN)?;
        let (view, seconds) = timed(|| one(engine.reconstruct(set.as_ref(), &view_work, TURN)?))?;
        let shared = TimedView { view, seconds, lighting };
        let draw = |camera: PinholeCamera, lighting: Lighting| {
            let work = DirectWork::of(&workload, vec![camera], planes);
            let work = DirectWork { lighting: lighting.to_string(), ..work };
            let (view, seconds) = timed(|| one(engine.draw_direct(&work, TURN)?))?;
            anyhow::Ok(TimedView { view, seconds, lighting })
        };
        draw(camera.resized(WARM_UP_PX), lighting)?;
        let hurried = most_rays_within(seconds, lighting, |lighting| draw(camera, lighting))?;
        let reference = draw(camera, lighting)?;
        Ok(Self { shared, shares_light: workload.planes.light, hurried, reference, samples_s })
    }
}

/// The view with the most rays that takes no longer than `seconds`, or the one with a ray a position.
fn most_rays_within(
    seconds: f64,
    lighting: Lighting,
    draw: impl Fn(Lighting) -> anyhow::Result<TimedView>,
) -> anyhow::Result<TimedView> {
    let ray_counts = std::iter::successors(NonZeroU32::new(SAMPLES_A_PIXEL), |rays| rays.checked_add(rays.get()));
    let mut lightings = ray_counts.map(|rays| lighting.with_at_most_rays(rays));
    let mut best = draw(lightings.next().unwrap_or(lighting))?;
    for lighting in lightings.take_while(|fewer| *fewer != lighting) {
        let next = draw(lighting)?;
        if next.seconds > seconds {
            break;
        }
        best = next;
    }
    Ok(best)
}

fn one(mut views: Vec<View>) -> anyhow::Result<View> {
    views.pop().context("no view")
}

fn timed<T>(make: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<(T, f64)> {
    let start = Instant::now();
    let made = make()?;
    Ok((made, start.elapsed().as_secs_f64()))
}

fn page(setup: &Setup, views: &PageViews) -> anyhow::Result<Picture> {
    let PageViews { shared, shares_light, hurried, reference, samples_s } = views;
    let (title, source) = if *shares_light { ("with shared light", "the light of ") } else { ("from samples", "") };
    let shared_error = FlipError::new(reference, shared)?;
    let hurried_error = FlipError::new(reference, hurried)?;
    let size_px = setup.samples.first().context("no sample cameras")?.size_px;
    let images = setup.samples.len();
    let samples = format!("{images} images of {}x{} px in {}", size_px.x, size_px.y, duration(*samples_s));
    let scene = format!("{}, {} triangles", setup.offer.name, setup.scene.triangle_count());
    let caption = format!(
        "{scene}, {}: {} with {source}{samples}, FLIP {:.3}; drawn directly with fewer rays {}, FLIP {:.3}; with all rays {}",
        reference.lighting,
        duration(shared.seconds),
        shared_error.mean,
        duration(hurried.seconds),
        hurried_error.mean,
        duration(reference.seconds),
    );
    let large = [
        titled(format!("drawn directly in {}", duration(hurried.seconds)), hurried)?,
        titled(format!("{title} in {}", duration(shared.seconds)), shared)?,
    ];
    let small = [
        titled(format!("directly, all rays: {}", duration(reference.seconds)), reference)?,
        hurried_error.titled("left"),
        shared_error.titled("right"),
    ];
    let facts = [
        format!("{scene}; {}; {SAMPLES_A_PIXEL} positions a pixel", reference.lighting),
        format!("left: {}. right: {source}{samples}, for all views", hurried.lighting),
    ];
    Ok(Picture::new("first page", caption, page_layout::page(large, small, facts)))
}

fn titled(title: String, timed: &TimedView) -> anyhow::Result<TitledPicture> {
    Ok(TitledPicture { title, image: pictures::rgb(&timed.view).context("a view is not of its size")? })
}

/// The error of a view against one with all rays.
struct FlipError {
    /// Over the pixels that show a surface.
    mean: f64,
    map: RgbImage,
}

impl FlipError {
    fn new(reference: &TimedView, timed: &TimedView) -> anyhow::Result<Self> {
        let [foreground, _] = PictureErrors::of(&reference.view, &timed.view)?;
        let map = pictures::error_map(&flip_map(&reference.view, &timed.view)?);
        Ok(Self { mean: foreground.flip, map })
    }

    fn titled(self, place: &str) -> TitledPicture {
        TitledPicture { title: format!("error, {place}: FLIP {:.3}", self.mean), image: self.map }
    }
}

/// Seconds, or milliseconds of times below one second.
fn duration(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", seconds * 1e3) } else { format!("{seconds:.1} s") }
}
