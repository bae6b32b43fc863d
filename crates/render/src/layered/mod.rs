//! Layered depth images: all surfaces that the lines of a parallel camera meet, by drawing without a test of depth, and their light.

mod crossings;
pub(crate) mod light_field;
mod lit;

use depth_image::{LayeredDepthImage, ParallelCamera, SpecularPlanes, oct8_from_oct16};
use rayon::prelude::*;

#[cfg(test)]
pub(crate) use crossings::{Crossing, GpuLines};
pub(crate) use lit::{BIAS_FOOTPRINTS, BIAS_ROUNDINGS, Lit};

use crate::{LayerSelection, RenderError, stages::Stages, work::DrawWork};

/// All surfaces of a scene on the lines of a camera. What sides send to all directions alike is their colour.
pub(crate) fn draw(
    stages: &Stages,
    work: DrawWork<'_>,
    camera: &ParallelCamera,
    kept: LayerSelection,
) -> Result<LayeredDepthImage, RenderError> {
    let (first, crossings, truncated) = crossings::met(stages, &work, camera, kept)?;
    let lit = lit::light(stages, work, camera, &first, &crossings)?;
    let reflects = crossings.par_iter().any(|crossing| crossing.surface[3] != 0) && work.highlight().is_some();
    Ok(LayeredDepthImage {
        camera: *camera,
        planar_depth_m: crossings.par_iter().map(|crossing| crossing.planar_depth_m).collect(),
        plane_normal_oct8: crossings.par_iter().map(|crossing| oct8_from_oct16(crossing.plane_normal_oct16)).collect(),
        color_rgb9e5: lit.color_rgb9e5,
        normal_oct16: reflects.then(|| crossings.par_iter().map(|crossing| crossing.surface[2]).collect()),
        specular: reflects.then(|| SpecularPlanes {
            reflectance_srgb8_roughness8: crossings.par_iter().map(|crossing| crossing.surface[3]).collect(),
            visibility8: lit.visibility8,
        }),
        first,
        truncated,
    })
}
