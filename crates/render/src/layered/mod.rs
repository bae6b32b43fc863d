//! Layered depth images: all surfaces that the lines of a parallel camera meet, by drawing without a test of depth, and their light.

mod crossings;
mod kept;
mod lit;

use depth_image::{LayeredDepthImage, ParallelCamera, SpecularPlanes, oct8_from_unit};
use glam::Vec3;
use rayon::prelude::*;

#[cfg(test)]
pub(crate) use crossings::{Crossing, GpuLines};
pub use kept::Kept;
pub(crate) use lit::Lit;

use crate::{RenderError, stages::Stages, work::DrawWork};

/// All surfaces of a scene on the lines of a camera. What sides send to all directions alike is their colour.
pub(crate) fn draw(
    stages: &Stages,
    work: DrawWork<'_>,
    camera: &ParallelCamera,
    kept: Kept,
) -> Result<LayeredDepthImage, RenderError> {
    let (first, crossings, truncated) = crossings::met(stages, &work, camera, kept)?;
    let lit = lit::light(stages, work, camera, (&first, &crossings))?;
    let reflects = crossings.par_iter().any(|crossing| crossing.surface[3] != 0) && work.highlight().is_some();
    let word = |word: usize| crossings.par_iter().map(|crossing| crossing.surface[word]).collect::<Vec<u32>>();
    Ok(LayeredDepthImage {
        camera: *camera,
        planar_depth_m: crossings.par_iter().map(|crossing| crossing.planar_depth_m).collect(),
        plane_normal_oct8: crossings.par_iter().map(|crossing| coarser(crossing.plane_normal_oct16)).collect(),
        color_rgb9e5: lit.color_rgb9e5,
        normal_oct16: reflects.then(|| word(2)),
        specular: reflects
            .then(|| SpecularPlanes { reflectance_srgb8_roughness8: word(3), visibility8: lit.visibility8 }),
        first,
        truncated,
    })
}

/// An octahedral normal in two bytes.
fn coarser(oct16: u32) -> u16 {
    let [x, y] = [oct16, oct16 >> 16].map(|bits| f32::from(bits as u16 as i16) / 32767.0);
    let z = 1.0 - x.abs() - y.abs();
    let wrapped = |a: f32, b: f32| (1.0 - b.abs()) * if a >= 0.0 { 1.0 } else { -1.0 };
    let unfolded = if z < 0.0 { Vec3::new(wrapped(x, y), wrapped(y, x), z) } else { Vec3::new(x, y, z) };
    oct8_from_unit(unfolded)
}
