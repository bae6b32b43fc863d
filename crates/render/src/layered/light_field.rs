//! Layered light fields: the light of all surfaces on the lines of many directions, towards each.

use bytemuck::Zeroable;
use depth_image::{
    Highlight, LayeredLightField, LightFieldCamera, ParallelCamera, PixelDepth, oct8_from_oct16, rgb9e5_from_linear,
    unit_from_oct8,
};
use glam::{UVec2, Vec3};
use gpu::GpuError;

use super::crossings::{self, Crossing};
use super::lit::{BIAS_FOOTPRINTS, BIAS_ROUNDINGS, mixed};
use crate::reflections::{bounces::GpuBounce, radiance::RadianceWork};
use crate::{LayerSelection, RenderError, stages::Stages, work::DrawWork};

/// A ray off a mirror meets nothing nearer than this share of the lines' spacing.
const NEAR_SPACINGS: f32 = 0.1;
/// Samples of a light field: as many fit a device's textures.
const MOST_SAMPLES: u64 = 1 << 26;

/// The light field of a scene whose lighting follows mirrors. One draw finds the surfaces of two opposite directions: each is a sample of
/// the one that it faces. There are none where nothing shows the scene.
pub(crate) fn draw(
    stages: &Stages,
    work: DrawWork<'_>,
    camera: &LightFieldCamera,
) -> Result<LayeredLightField, RenderError> {
    let mut first = vec![0];
    let mut planar_depth_m = Vec::new();
    if work.highlight() != Some(Highlight::Ggx) || work.lighting.without_reflections().is_none() {
        first.resize(camera.line_count() + 1, 0);
        return Ok(LayeredLightField { camera: *camera, first, planar_depth_m, radiance_rgb9e5: Vec::new() });
    }
    let mut light = RadianceWork::of(stages, work)?;
    let directions = camera.directions.all();
    for pair in directions.chunks(2).skip(camera.first_pair as usize).take(camera.pairs as usize) {
        let lines = camera.lines(pair[0].towards);
        // Of a line with more surfaces than an image holds the first ones count.
        let (first_of_line, crossings, _) = crossings::met(stages, &work, &lines, LayerSelection::All)?;
        GpuError::check_limit("the samples of a light field", planar_depth_m.len() as u64, MOST_SAMPLES)?;
        let columns = lines.size_px.x as usize;
        for (is_opposite, direction) in [false, true].into_iter().zip(pair) {
            for number in 0..lines.pixel_count() {
                // The opposite direction counts columns and depths from their other ends.
                let mirrored = number - number % columns + (columns - 1 - number % columns);
                let line = if is_opposite { mirrored } else { number };
                let on_line = &crossings[first_of_line[line] as usize..first_of_line[line + 1] as usize];
                let mut facing: Vec<&Crossing> = on_line.iter().filter(|c| faces(c, direction.towards)).collect();
                if is_opposite {
                    facing.reverse();
                }
                let depths_m = facing.iter().map(|crossing| crossing.planar_depth_m);
                planar_depth_m.extend(depths_m.map(|depth| if is_opposite { lines.range_m - depth } else { depth }));
                first.push(planar_depth_m.len() as u32);
                light.add(facing.into_iter().map(|crossing| point(&lines, crossing, direction.towards)))?;
            }
        }
    }
    let radiance_rgb9e5 = light.finish()?.into_iter().map(rgb9e5_from_linear).collect();
    Ok(LayeredLightField { camera: *camera, first, planar_depth_m, radiance_rgb9e5 })
}

fn faces(crossing: &Crossing, towards: Vec3) -> bool {
    unit_from_oct8(oct8_from_oct16(crossing.plane_normal_oct16)).dot(towards) > 0.0
}

/// A surface as a point that is seen from where its light goes.
fn point(lines: &ParallelCamera, crossing: &Crossing, towards: Vec3) -> GpuBounce {
    let columns = lines.size_px.x;
    let pixel = UVec2::new(crossing.line % columns, crossing.line / columns).as_vec2() + 0.5;
    let point = lines.unproject(PixelDepth { pixel, planar_depth_m: crossing.planar_depth_m });
    let place = (point / lines.spacing_m * 16.0).round().as_ivec3().to_array();
    GpuBounce {
        point_in_world: point.to_array(),
        direction: (-towards).to_array(),
        // Of the point's place: tiles have the noise of the whole.
        seed: place.into_iter().fold(1, |seed, along| mixed(seed ^ along as u32)),
        side_m: lines.spacing_m,
        near_m: NEAR_SPACINGS * lines.spacing_m,
        surface: crossing.surface,
        bias_m: BIAS_FOOTPRINTS * lines.spacing_m + BIAS_ROUNDINGS * point.abs().max_element(),
        ..GpuBounce::zeroed()
    }
}
