//! The first page: one view in soft light, drawn directly and reconstructed.

use std::fmt;
use std::path::Path;

use anyhow::Context as _;
use app_core::delivery::request;
use app_core::experiment::Experiment;
use app_core::setup::Setup;
use cluster::{Costs, PolicyChoice, SessionRequest};
use depth_image::{Antialias, Camera, PinholeCamera, View, ViewPlanes};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use metrics::{PictureErrors, Rgb8Image, flip_map};
use render::Lighting;
use report::Picture;

use super::page_layout::{PageParts, VIEW_PX};
use super::viewpoint::Viewpoint;
use super::{DemoArgs, start};

/// The light of the page, unless the user names one. Few rays a sample are enough: a pixel has the mean of four samples,
/// or of four images.
const LIGHTING: &str = "soft 1, occlusion 2";
/// The side of sample images over that of the view, unless the user names a size.
const DENSITY: f32 = 1.25;
const SAMPLES_A_PIXEL: u32 = 4;

/// Makes the page and writes it as `first-page.png` to `args.out`.
///
/// # Errors
/// The device or the cluster fails, or the folder cannot be written.
pub(super) fn write(args: &DemoArgs, setup: Setup) -> anyhow::Result<Picture> {
    let viewpoint = Viewpoint::of(&args.scene.scene, &setup)?;
    let camera = viewpoint.camera(VIEW_PX.into());
    let denser_px = (camera.size_px.as_vec2() * DENSITY).as_uvec2();
    let around = viewpoint.samples(args.scene.sample_size.fixed_px().unwrap_or(denser_px));
    let samples = args.scene.sampling().cameras(around.clone());
    // A cluster of its own: the page's views are far larger than the others, and so are their buffers.
    let experiment = start(args, Setup { around, samples, ..setup })?;
    let picture = page(args, &experiment, camera)?;
    experiment.stop()?;
    let path = args.out.join("first-page.png");
    save(&picture, &path).with_context(|| path.display().to_string())?;
    println!("first page: {}", path.display());
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

/// The view by both policies, and the costs that the coordinator has measured on it.
struct PageViews {
    direct: View,
    reconstructed: View,
    costs: Costs,
}

impl PageViews {
    fn receive(experiment: &Experiment, camera: PinholeCamera, lighting: Lighting) -> anyhow::Result<Self> {
        let antialias = Antialias::of(SAMPLES_A_PIXEL).context("four samples are offered")?;
        let shared = SessionRequest {
            lighting: lighting.to_string(),
            sample_cameras: experiment.setup.samples.iter().copied().map(Camera::Pinhole).collect(),
            planes: ViewPlanes { antialias, ..ViewPlanes::ALL },
            ..request(experiment.setup.offer.settings.clone(), &[camera])?
        };
        let mut views = Vec::with_capacity(2);
        let mut costs = Costs::default();
        for policy in [PolicyChoice::Pipeline, PolicyChoice::Direct] {
            let request = SessionRequest { policy, ..shared.clone() };
            let delivered = experiment.receive(request, &[camera], |frame| views.push(frame.view))?;
            if policy == PolicyChoice::Pipeline {
                costs = delivered.plan.costs;
            }
        }
        let direct = views.pop().context("no view was drawn")?;
        let reconstructed = views.pop().context("no view was reconstructed")?;
        Ok(Self { direct, reconstructed, costs })
    }
}

fn page(args: &DemoArgs, experiment: &Experiment, camera: PinholeCamera) -> anyhow::Result<Picture> {
    let is_named = args.scene.lighting != Lighting::default();
    let lighting = if is_named { args.scene.lighting } else { LIGHTING.parse()? };
    let PageViews { direct, reconstructed, costs } = PageViews::receive(experiment, camera, lighting)?;
    let reconstructed_picture = Rgb8Image::of_view(&reconstructed)?;
    let [foreground, whole] = PictureErrors::of(&direct, &reconstructed_picture)?;
    let figures =
        PageFigures { direct_s: costs.direct_view_s, reconstruct_s: costs.reconstruct_view_s, foreground, whole }
            .to_string();
    let setup = &experiment.setup;
    let sample_px = setup.samples.first().context("no sample cameras")?.size_px;
    let samples_s = costs.sample_image_s * setup.samples.len() as f64;
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
            format!("{} depth images {}x{}: {}", setup.samples.len(), sample_px.x, sample_px.y, duration(samples_s)),
        ],
        figures: format!("a view: {figures}"),
    };
    let caption = format!("A view drawn directly, and reconstructed: {figures}");
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
