//! The first page: one view in soft light, drawn directly and reconstructed.

use std::fmt;
use std::path::Path;
use std::time::Instant;

use anyhow::Context as _;
use app_core::print_line;
use app_core::setup::Setup;
use cluster::{Refinement, SamplePlanes};
use depth_image::{Antialias, PinholeCamera, View, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use metrics::{PictureErrors, Rgb8Image, flip_map};
use node::{DirectWork, Engine as _, SampleSet, SampleWork, Turn, ViewWork, WorkClass};
use render::Lighting;
use report::Picture;

use super::args::DemoArgs;
use super::page_layout::{PageParts, VIEW_PX};
use super::viewpoint::Viewpoint;

/// The side of sample images over that of the view, unless the user names a size: light needs no more.
const DENSITY: f32 = 0.5;
const SAMPLES_A_PIXEL: u32 = 4;
/// The size of the view that is drawn before the timed one.
const WARM_UP_PX: UVec2 = UVec2::new(32, 20);

/// Makes the page and writes it as `first-page.png` to `args.out`.
///
/// # Errors
/// The samples are no depth images, the device fails, or the folder cannot be written.
pub(super) fn write(args: &DemoArgs, setup: Setup) -> anyhow::Result<Picture> {
    setup.check_depth_images()?;
    let viewpoint = Viewpoint::of(&args.scene.scene, &setup)?;
    let camera = viewpoint.camera(VIEW_PX.into());
    let denser_px = (camera.size_px.as_vec2() * DENSITY).as_uvec2();
    let around = viewpoint.samples(args.scene.sample_size.fixed_px().unwrap_or(denser_px));
    let samples = args.scene.sampling().cameras(around.clone());
    let picture = page(args, &Setup { around, samples, ..setup }, camera)?;
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

/// The view of the page, drawn directly and reconstructed, and the times of both on an idle device.
struct PageViews {
    direct: View,
    direct_s: f64,
    reconstructed: View,
    reconstruct_s: f64,
    /// The time of all sample images.
    samples_s: f64,
}

impl PageViews {
    fn make(args: &DemoArgs, setup: &Setup, camera: PinholeCamera, lighting: Lighting) -> anyhow::Result<Self> {
        // A device of its own: the page's views are far larger than the others, and so are their buffers.
        let engine = GpuEngine::shared(args.device.device)?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        let turn = Turn::of(WorkClass::Batch);
        let antialias = Antialias::of(SAMPLES_A_PIXEL).context("four samples are offered")?;
        let planes = ViewPlanes { antialias, ..ViewPlanes::ALL };
        let method = args.scene.method_in(lighting);
        let set_work = sample_work(args, setup, lighting, engine.sample_planes(&method)?);
        let (images, samples_s) = timed(|| Ok(engine.sample(&set_work, turn)?))?;
        let set = SampleSet {
            scene_hash: setup.offer.hash.to_string(),
            images: images.try_into()?,
            volume: setup.offer.volume,
            background: setup.offer.background,
            illumination: setup.offer.illumination.clone(),
            lighting: lighting.to_string(),
            scene_time_s: 0.0,
            traced_pixel_count: None,
            is_common: false,
        };
        let set = engine.upload(&set, turn)?;
        let view_work = ViewWork { cameras: vec![camera], method, planes };
        let reconstruct = || one(engine.reconstruct(set.as_ref(), &view_work, turn)?);
        // The first view of a size also makes its buffers and shaders.
        reconstruct()?;
        let (reconstructed, reconstruct_s) = timed(reconstruct)?;
        let draw = |camera| {
            let (scene_hash, lighting) = (setup.offer.hash.to_string(), lighting.to_string());
            let work = DirectWork {
                scene_hash,
                cameras: vec![camera],
                lighting,
                scene_time_s: 0.0,
                planes,
                surfaces_by_rays: None,
            };
            one(engine.draw_direct(&work, turn)?)
        };
        draw(camera.resized(WARM_UP_PX))?;
        let (direct, direct_s) = timed(|| draw(camera))?;
        Ok(Self { direct, direct_s, reconstructed, reconstruct_s, samples_s })
    }
}

fn sample_work(args: &DemoArgs, setup: &Setup, lighting: Lighting, planes: SamplePlanes) -> SampleWork {
    SampleWork {
        scene_hash: setup.offer.hash.to_string(),
        cameras: setup.samples.iter().copied().map(Into::into).collect(),
        wanted: (0..setup.samples.len() as u32).collect(),
        sampling: args.scene.sampling().to_string(),
        planes,
        lighting: lighting.to_string(),
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

fn page(args: &DemoArgs, setup: &Setup, camera: PinholeCamera) -> anyhow::Result<Picture> {
    let lighting = args.expensive_light()?;
    let PageViews { direct, direct_s, reconstructed, reconstruct_s, samples_s } =
        PageViews::make(args, setup, camera, lighting)?;
    let reconstructed_picture = Rgb8Image::of_view(&reconstructed)?;
    let [foreground, whole] = PictureErrors::of(&direct, &reconstructed_picture)?;
    let figures = PageFigures { direct_s, reconstruct_s, foreground, whole }.to_string();
    let sample_px = setup.samples.first().context("no sample cameras")?.size_px;
    let (provenance, legend) = pictures::provenance(&reconstructed, 0).context("a view without provenance")?;
    let parts = PageParts {
        direct: pictures::rgb(&direct).context("a view is not of its size")?,
        reconstructed: pictures::rgb(&reconstructed).context("a view is not of its size")?,
        provenance,
        legend,
        error_map: pictures::error_map(&flip_map(&Rgb8Image::of_view(&direct)?, &reconstructed_picture)?),
        facts: vec![
            format!("{}, {} triangles", setup.offer.name, setup.scene.triangle_count()),
            format!("{lighting}; {SAMPLES_A_PIXEL} samples a pixel"),
            format!("{} sample images {}x{}: {}", setup.samples.len(), sample_px.x, sample_px.y, duration(samples_s)),
        ],
        figures: format!("a view: {figures}"),
    };
    let caption = format!("A view drawn directly, and made with samples: {figures}");
    Ok(Picture::new("first page", caption, parts.page()))
}

/// Times and errors of the page's view.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PageFigures {
    direct_s: f64,
    reconstruct_s: f64,
    foreground: PictureErrors,
    whole: PictureErrors,
}

impl fmt::Display for PageFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { direct_s, reconstruct_s, foreground, whole } = self;
        write!(f, "g_v {}, c {}; ", duration(*direct_s), duration(*reconstruct_s))?;
        write!(f, "foreground: PSNR {:.1} dB, FLIP {:.3}; ", foreground.psnr_db, foreground.flip)?;
        write!(f, "whole picture: {:.1} dB, {:.3}", whole.psnr_db, whole.flip)
    }
}

/// Seconds, or milliseconds of times below one second.
fn duration(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", seconds * 1e3) } else { format!("{seconds:.1} s") }
}

#[cfg(test)]
mod tests {
    use super::super::page_layout::fits;
    use super::*;

    #[test]
    fn the_foreground_is_named_first_and_the_line_fits() {
        let errors = |psnr_db, flip| PictureErrors { psnr_db, ssim: 1.0, flip };
        let longest = PageFigures {
            direct_s: 12.34,
            reconstruct_s: 0.9994,
            foreground: errors(28.04, 0.0714),
            whole: errors(99.99, 1.0),
        };
        let expected = "g_v 12.3 s, c 999 ms; foreground: PSNR 28.0 dB, FLIP 0.071; whole picture: 100.0 dB, 1.000";
        assert_eq!(longest.to_string(), expected);
        assert!(fits(&format!("a view: {longest}")));
    }
}
