//! The first page: one view, drawn and reconstructed, in soft light.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context as _;
use app_core::setup::{SceneArgs, Setup};
use depth_image::{Antialias, PinholeCamera, View, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use metrics::{PictureErrors, Rgb8Image, flip_map};
use render::Lighting;
use study::Picture;

use super::page::{Parts, VIEW_PX};
use super::viewpoint::Viewpoint;
use crate::reference_views::ReferenceViews;

/// The light of the page where no other is asked for. Few rays a sample are enough: a pixel has the mean of four
/// samples, or of four images.
const LIGHTING: &str = "soft 1, occlusion 2";
/// The sides of sample images over the view's, where no size is asked for.
const DENSITY: f32 = 1.25;
const SAMPLES_A_PIXEL: u32 = 4;
/// The sides of the view that is drawn before those that are timed.
const WARM_UP_PX: UVec2 = UVec2::new(32, 20);

/// Times and errors of the page's view.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Figures {
    direct_s: f64,
    reconstruct_s: f64,
    foreground: PictureErrors,
    whole: PictureErrors,
}

impl std::fmt::Display for Figures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { direct_s, reconstruct_s, foreground, whole } = self;
        write!(f, "g_v {}, c {}; ", time(*direct_s), time(*reconstruct_s))?;
        write!(f, "foreground: PSNR {:.1} dB, FLIP {:.3}; ", foreground.psnr_db, foreground.flip)?;
        write!(f, "whole picture: {:.1} dB, {:.3}", whole.psnr_db, whole.flip)
    }
}

/// Seconds, or milliseconds of times below one second.
fn time(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.0} ms", seconds * 1e3) } else { format!("{seconds:.1} s") }
}

/// Makes the page, and writes it to a folder, which is made if need be.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn write(engine: &Arc<GpuEngine>, setup: Setup, args: &SceneArgs, folder: &Path) -> anyhow::Result<Picture> {
    let picture = first_page(engine, setup, args)?;
    let path = folder.join("first-page.png");
    let writing = || -> anyhow::Result<()> {
        std::fs::create_dir_all(folder)?;
        let file = std::io::BufWriter::new(std::fs::File::create(&path)?);
        let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
        Ok(picture.image.write_with_encoder(encoder)?)
    };
    writing().with_context(|| path.display().to_string())?;
    println!("first page: {}", path.display());
    Ok(picture)
}

fn first_page(engine: &Arc<GpuEngine>, setup: Setup, args: &SceneArgs) -> anyhow::Result<Picture> {
    let asked = args.lighting != Lighting::default();
    let lighting = if asked { args.lighting } else { LIGHTING.parse()? };
    let args = SceneArgs { lighting, ..args.clone() };
    let viewpoint = Viewpoint::of(&args.scene, &setup)?;
    let camera = viewpoint.camera(VIEW_PX.into());
    let denser_px = (camera.size_px.as_vec2() * DENSITY).as_uvec2();
    let around = viewpoint.samples(args.sample_size.fixed_px().unwrap_or(denser_px));
    let setup = Setup { samples: args.sampling().cameras(around.clone()), around, ..setup };
    let start = Instant::now();
    let reference = ReferenceViews::draw(engine, &setup, &args, vec![camera.resized(WARM_UP_PX)])?;
    let samples_s = start.elapsed().as_secs_f64();
    let (views, seconds) = timed_views(&reference, &setup, &args, camera)?;
    parts(&setup, &args, samples_s, &views, seconds)
}

/// The view drawn directly and reconstructed, and the seconds of both.
fn timed_views(
    reference: &ReferenceViews,
    setup: &Setup,
    args: &SceneArgs,
    camera: PinholeCamera,
) -> anyhow::Result<([View; 2], [f64; 2])> {
    let antialias = Antialias::of(SAMPLES_A_PIXEL).context("four samples are offered")?;
    let planes = ViewPlanes { antialias, ..ViewPlanes::ALL };
    let (direct, direct_s) = timed(|| reference.drawn_from(setup, args.lighting, &[camera], planes))?;
    // The first reconstruction of a size also makes its buffers.
    reference.reconstruct_at(&[camera], args.method(), planes)?;
    let (view, reconstruct_s) = timed(|| reference.reconstruct_at(&[camera], args.method(), planes))?;
    Ok(([direct, view], [direct_s, reconstruct_s]))
}

fn timed(make: impl FnOnce() -> anyhow::Result<Vec<View>>) -> anyhow::Result<(View, f64)> {
    let start = Instant::now();
    let view = make()?.pop().context("no view")?;
    Ok((view, start.elapsed().as_secs_f64()))
}

fn parts(
    setup: &Setup,
    args: &SceneArgs,
    samples_s: f64,
    [direct, view]: &[View; 2],
    [direct_s, reconstruct_s]: [f64; 2],
) -> anyhow::Result<Picture> {
    let (expected, actual) = (Rgb8Image::of_view(direct)?, Rgb8Image::of_view(view)?);
    let [foreground, whole] = PictureErrors::of(direct, &actual)?;
    let figures = Figures { direct_s, reconstruct_s, foreground, whole }.to_string();
    let rgb = |view| pictures::rgb(view).context("a view is not of its size");
    let (provenance, legend) = pictures::provenance(view, 0).context("a view without provenance")?;
    let size_px = setup.samples.first().context("no sample cameras")?.size_px;
    let page = Parts {
        direct: rgb(direct)?,
        reconstructed: rgb(view)?,
        provenance,
        legend,
        error_map: pictures::error_map(&flip_map(&expected, &actual)?),
        facts: vec![
            format!("{}, {} triangles", setup.offer.name, setup.scene.triangle_count()),
            format!("{}; {SAMPLES_A_PIXEL} samples a pixel", args.lighting),
            format!("{} depth images {}x{}: {}", setup.samples.len(), size_px.x, size_px.y, time(samples_s)),
        ],
        figures: format!("a view: {figures}"),
    };
    Ok(Picture::new("first page", format!("A view drawn directly, and reconstructed: {figures}"), page.page()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::page::fits;

    #[test]
    fn the_foreground_is_named_first_and_the_line_fits() {
        let errors = |psnr_db, flip| PictureErrors { psnr_db, ssim: 1.0, flip };
        let longest = Figures {
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
