//! The graph image, and what the teapot mirrors by images beside the truth.

use depth_image::{Environment, ProvenanceKind, Ray, ToneMapping};
use glam::{UVec2, Vec3};
use gpu::Turn;
use image::{Rgb, RgbImage};
use rayon::prelude::*;
use reconstruction::RayWork;
use render::{Lighting, SamplePlanes};
use report::{Picture, PictureRow};

use super::cameras;
use super::found::SEARCH;
use super::subject::{NEAR_M, Shown, Subject};
use crate::failures::stage::in_the_dark;
use crate::graph::GraphImage;
use crate::impostors::surfaces::SKY_SRGB;

const VIEW_PX: UVec2 = UVec2::new(400, 300);
/// Places near the entrance, in the middle and at the end.
const PLACES: [usize; 3] = [4, 14, 27];
/// Every second texel.
const TEXELS_PX: u32 = 2;

/// The texels of a nested image.
pub fn graph_image(name: &str, image: &GraphImage<'_>) -> Picture {
    let part = &image.parts[0];
    let size_px = part.size_px / TEXELS_PX;
    let picture = RgbImage::from_fn(size_px.x, size_px.y, |x, y| {
        let sample = part.at(UVec2::new(x, y) * TEXELS_PX);
        Rgb(sample.map_or(SKY_SRGB, |sample| ToneMapping::NONE.srgb8(sample.color_linear())))
    });
    Picture::new(format!("{name} graph"), "the whole maze in one nested image", picture)
}

/// Views of the teapot at some places by direct rays and by three kinds of images.
///
/// # Errors
/// The device fails.
pub fn reflections(
    subject: &Subject<'_>,
    nested: &GraphImage<'_>,
    apart: &GraphImage<'_>,
) -> anyhow::Result<Vec<PictureRow>> {
    PLACES.iter().map(|&place| reflections_at(subject, place, [nested, apart])).collect()
}

fn reflections_at(subject: &Subject<'_>, place: usize, graphs: [&GraphImage<'_>; 2]) -> anyhow::Result<PictureRow> {
    let camera = subject.view(place, VIEW_PX);
    let shown = subject.shown(place, &camera);
    let rays: Vec<Ray> = shown
        .iter()
        .filter_map(|shown| match shown {
            Shown::Mirror(ray) => Some(*ray),
            Shown::Surface(_) | Shown::Sky => None,
        })
        .collect();
    let truth: Vec<Option<Vec3>> = rays.par_iter().map(|ray| subject.color_linear(ray)).collect();
    let [nested, apart] = graphs.map(|image| {
        let ends = rays.par_iter().map(|ray| image.follow(ray, f64::from(NEAR_M), SEARCH).met);
        ends.map(|hit| hit.map(|hit| hit.color_linear)).collect::<Vec<_>>()
    });
    let pinholes = in_pinholes(subject, &rays)?;
    let kinds = [("rays", truth), ("nested", nested), ("apart", apart), ("pinholes from above", pinholes)];
    let name = subject.name();
    let pictures = kinds
        .map(|(kind, colors)| Picture::new(format!("{name} place {place} {kind}"), kind, picture(&shown, &colors)));
    Ok(PictureRow {
        title: format!("{name}: the teapot at place {place}, by rays and by images"),
        pictures: pictures.into(),
    })
}

fn in_pinholes(subject: &Subject<'_>, rays: &[Ray]) -> anyhow::Result<Vec<Option<Vec3>>> {
    let cameras = cameras::above(&subject.maze);
    let images = subject.stand.images(&subject.on_device, Lighting::UNLIT, &cameras, SamplePlanes::default())?;
    let description = in_the_dark(subject.scene.bounds(), Environment::uniform(Vec3::ZERO));
    let set = subject.stand.reconstructor().upload(&images, &description, Turn::default())?;
    let (ends, _) = subject.stand.reconstructor().follow(RayWork::new(&set, NEAR_M), rays)?;
    Ok(ends.iter().map(|end| (end.kind == ProvenanceKind::Hit).then_some(end.color_linear)).collect())
}

fn picture(shown: &[Shown], mirrored: &[Option<Vec3>]) -> RgbImage {
    let mut mirrored = mirrored.iter();
    let colors: Vec<[u8; 3]> = shown
        .iter()
        .map(|shown| {
            let color_linear = match shown {
                Shown::Mirror(_) => mirrored.next().copied().flatten(),
                Shown::Surface(color_linear) => Some(*color_linear),
                Shown::Sky => None,
            };
            color_linear.map_or(SKY_SRGB, |color| ToneMapping::NONE.srgb8(color))
        })
        .collect();
    RgbImage::from_fn(VIEW_PX.x, VIEW_PX.y, |x, y| Rgb(colors[(y * VIEW_PX.x + x) as usize]))
}
