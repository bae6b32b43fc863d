//! The view from the middle of the walk, in the light that each method leaves.

use depth_image::ToneMapping;
use glam::{DVec3, UVec2, Vec3};
use image::{Rgb, RgbImage};
use rayon::prelude::*;
use report::{Picture, PictureRow};

use super::methods::FINE;
use super::search::SurfacePoint;
use super::subject::{Blocks, behind_block, set_cameras, view};
use crate::graph::{GraphCamera, GraphImage, pinhole};
use crate::impostors::surfaces::SKY_SRGB;

/// Sizes in full and in quick runs.
const SIZE_PX: [UVec2; 2] = [UVec2::new(1280, 720), UVec2::new(640, 360)];
const RAYS: [u32; 2] = [64, 16];

/// # Errors
/// A camera cannot be used.
pub fn head_on(blocks: &Blocks, is_quick: bool) -> anyhow::Result<PictureRow> {
    let size = usize::from(is_quick);
    let size_px = SIZE_PX[size];
    let camera = view(0.0, size_px);
    let own_camera = pinhole(&camera)?;
    let own = blocks.image(&own_camera);
    let graph_camera = behind_block(&camera)?;
    let graph = blocks.image(&graph_camera);
    let set = set_cameras(size_px).iter().map(pinhole).collect::<anyhow::Result<Vec<GraphCamera>>>()?;
    let shared: Vec<GraphImage<'_>> = set.iter().map(|camera| blocks.image(camera)).collect();
    let pictures = [
        ("own z-buffer", picture(&own, |at| FINE.in_image(&own, at).unwrap_or(0.0))),
        ("graph camera's z-buffer", picture(&own, |at| FINE.in_image(&graph, at).unwrap_or(0.0))),
        ("four images of a set", picture(&own, |at| FINE.in_any_image(&shared, at))),
        ("rays", picture(&own, |at| by_rays(blocks, at, RAYS[size]))),
    ];
    let pictures = pictures.map(|(name, picture)| Picture::new(format!("hidden-block by {name}"), name, picture));
    Ok(PictureRow { title: "hidden-block: ambient occlusion (Fig. 3)".into(), pictures: pictures.into() })
}

fn by_rays(blocks: &Blocks, at: SurfacePoint, rays: u32) -> f64 {
    blocks.by_rays(at.point.as_vec3(), at.normal.as_vec3(), rays, pattern_turn(at.point))
}

/// A turn of the rays that differs from point to point.
fn pattern_turn(point: DVec3) -> f32 {
    point.dot(DVec3::new(7919.0, 6101.0, 4657.0)).rem_euclid(std::f64::consts::TAU) as f32
}

fn picture(image: &GraphImage<'_>, occlusion: impl Fn(SurfacePoint) -> f64 + Sync) -> RgbImage {
    let part = &image.parts[0];
    let size_px = part.size_px;
    let texels = (0..size_px.element_product()).into_par_iter();
    let colors: Vec<[u8; 3]> = texels
        .map(|texel| {
            let texel = UVec2::new(texel % size_px.x, texel / size_px.x);
            part.at(texel).map_or(SKY_SRGB, |sample| {
                let at = SurfacePoint { point: image.point(&sample, texel), normal: sample.normal_in_world() };
                ToneMapping::NONE.srgb8(Vec3::splat(1.0 - occlusion(at) as f32))
            })
        })
        .collect();
    RgbImage::from_fn(size_px.x, size_px.y, |x, y| Rgb(colors[(y * size_px.x + x) as usize]))
}
