//! The first page: one view with shared light, beside direct drawing in the same time.

use std::num::NonZeroU32;
use std::path::Path;
use std::time::Instant;

use anyhow::Context as _;
use app_core::print_line;
use app_core::setup::{SceneArgs, Setup};
use cluster::{Refinement, SamplePlanes};
use depth_image::{Antialias, PinholeCamera, SampleImage, View, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use image::RgbImage;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use metrics::{PictureErrors, Rgb8Image, flip_map};
use node::{DirectWork, Engine as _, SampleSet, SampleWork, Turn, ViewWork, WorkClass};
use render::Lighting;
use report::Picture;

use super::args::DemoArgs;
use super::page_layout::{PageParts, TitledPicture, VIEW_PX};
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
    /// With light from samples.
    shared: TimedView,
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
        let set_work = sample_work(page_scene, setup, engine.sample_planes(&method)?);
        let (images, samples_s) = timed(|| Ok(engine.sample(&set_work, TURN)?))?;
        let set = engine.upload(&sample_set(setup, images, lighting)?, TURN)?;
        let view_work = ViewWork { cameras: vec![camera], method, planes };
        let reconstruct = || one(engine.reconstruct(set.as_ref(), &view_work, TURN)?);
        // The first view of a size also makes its buffers and shaders.
        reconstruct()?;
        let (view, seconds) = timed(reconstruct)?;
        let shared = TimedView { view, seconds, lighting };
        let draw = |camera: PinholeCamera, lighting: Lighting| {
            let work = direct_work(setup, camera, lighting, planes);
            let (view, seconds) = timed(|| one(engine.draw_direct(&work, TURN)?))?;
            anyhow::Ok(TimedView { view, seconds, lighting })
        };
        draw(camera.resized(WARM_UP_PX), lighting)?;
        let hurried = most_rays_within(seconds, lighting, |lighting| draw(camera, lighting))?;
        let reference = draw(camera, lighting)?;
        Ok(Self { shared, hurried, reference, samples_s })
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

fn sample_set(setup: &Setup, images: Vec<SampleImage>, lighting: Lighting) -> anyhow::Result<SampleSet> {
    Ok(SampleSet {
        scene_hash: setup.offer.hash.to_string(),
        images: images.try_into()?,
        volume: setup.offer.volume,
        background: setup.offer.background,
        illumination: setup.offer.illumination.clone(),
        lighting: lighting.to_string(),
        scene_time_s: 0.0,
        traced_pixel_count: None,
        is_common: false,
    })
}

fn direct_work(setup: &Setup, camera: PinholeCamera, lighting: Lighting, planes: ViewPlanes) -> DirectWork {
    DirectWork {
        scene_hash: setup.offer.hash.to_string(),
        cameras: vec![camera],
        lighting: lighting.to_string(),
        scene_time_s: 0.0,
        planes,
        surfaces_by_rays: None,
    }
}

fn sample_work(page_scene: &SceneArgs, setup: &Setup, planes: SamplePlanes) -> SampleWork {
    SampleWork {
        scene_hash: setup.offer.hash.to_string(),
        cameras: setup.samples.iter().copied().map(Into::into).collect(),
        wanted: (0..setup.samples.len() as u32).collect(),
        sampling: page_scene.sampling().to_string(),
        planes,
        lighting: page_scene.lighting.to_string(),
        scene_time_s: 0.0,
        temporal_reference_s: None,
        refinement: Refinement::default(),
        surfaces_by_rays: None,
    }
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
    let PageViews { shared, hurried, reference, samples_s } = views;
    let shared_error = FlipError::new(reference, shared)?;
    let hurried_error = FlipError::new(reference, hurried)?;
    let size_px = setup.samples.first().context("no sample cameras")?.size_px;
    let images = setup.samples.len();
    let samples = format!("{images} images of {}x{} px in {}", size_px.x, size_px.y, duration(*samples_s));
    let scene = format!("{}, {} triangles", setup.offer.name, setup.scene.triangle_count());
    let caption = format!(
        "{scene}, {}: {} with the light of {samples}, FLIP {:.3}; drawn directly with fewer rays {}, FLIP {:.3}; with all rays {}",
        reference.lighting,
        duration(shared.seconds),
        shared_error.mean,
        duration(hurried.seconds),
        hurried_error.mean,
        duration(reference.seconds),
    );
    let parts = PageParts {
        hurried: TitledPicture::new(format!("drawn directly in {}", duration(hurried.seconds)), rgb(hurried)?),
        shared: TitledPicture::new(format!("with shared light in {}", duration(shared.seconds)), rgb(shared)?),
        reference: TitledPicture::new(format!("directly, all rays: {}", duration(reference.seconds)), rgb(reference)?),
        hurried_error: hurried_error.titled("left"),
        shared_error: shared_error.titled("right"),
        facts: [
            format!("{scene}; {}; {SAMPLES_A_PIXEL} positions a pixel", reference.lighting),
            format!("left: {}. right: light of {samples}, for all views", hurried.lighting),
        ],
    };
    Ok(Picture::new("first page", caption, parts.page()))
}

fn rgb(timed: &TimedView) -> anyhow::Result<RgbImage> {
    pictures::rgb(&timed.view).context("a view is not of its size")
}

/// The error of a view against one with all rays.
struct FlipError {
    /// Over the pixels that show a surface.
    mean: f64,
    map: RgbImage,
}

impl FlipError {
    fn new(reference: &TimedView, timed: &TimedView) -> anyhow::Result<Self> {
        let picture = Rgb8Image::of_view(&timed.view)?;
        let [foreground, _] = PictureErrors::of(&reference.view, &picture)?;
        let map = pictures::error_map(&flip_map(&Rgb8Image::of_view(&reference.view)?, &picture)?);
        Ok(Self { mean: foreground.flip, map })
    }

    fn titled(self, place: &str) -> TitledPicture {
        TitledPicture::new(format!("error, {place}: FLIP {:.3}", self.mean), self.map)
    }
}

/// Seconds, or milliseconds of times below one second.
fn duration(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", seconds * 1e3) } else { format!("{seconds:.1} s") }
}
