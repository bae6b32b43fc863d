//! Detection of redundant samples against the size of triangles: a finely tessellated wall that both images see whole.

use std::sync::Arc;

use depth_image::{Camera, DepthImage, PinholeCamera};
use engine::GpuEngine;
use glam::{Mat2, UVec2, Vec2, Vec3};
use render::{DrawWork, Lighting, SamplePlanes, Visibility};
use sampling::{Redundancy, SampleWork, Sampler, SamplingMethod};
use scene::{Mesh, MeshPart, Scene, Vertex};

use crate::failures::stand::work;

const SIDE_PX: u32 = 64;
const DISTANCE_M: f32 = 4.0;
/// The distance of the two viewpoints.
const BASELINE_M: f32 = 0.37;
const TESTS: [Redundancy; 3] = [Redundancy::Pixel, Redundancy::Visibility, Redundancy::Coverage];

/// The shares of redundant samples that the tests by pixel, visibility and coverage find on a wall of triangles with
/// legs of this length.
///
/// # Errors
/// The device's.
pub fn found_redundant(engine: &Arc<GpuEngine>, leg_px: f32) -> anyhow::Result<[f64; 3]> {
    let sampler = Sampler::sharing(engine.renderer.clone());
    let name = format!("wall cut to {leg_px} px");
    engine.put_scene(&name, &wall(leg_px))?;
    let on_device = engine.scene(&name)?;
    let draw = DrawWork { visibility: Visibility::Measured, ..work(&on_device, Lighting::UNLIT) };
    let mut found = [0.0; 3];
    for (found, test) in found.iter_mut().zip(TESTS) {
        let method = SamplingMethod::NonRedundant(test);
        let planes = SamplePlanes::default();
        let images = sampler.sample(&SampleWork {
            draw,
            cameras: &cameras(),
            tile_count: 1,
            wanted: &[0, 1],
            method,
            planes,
        })?;
        *found = left_out(&images[1]);
    }
    Ok(found)
}

fn cameras() -> [Camera; 2] {
    [0.0, BASELINE_M].map(|x| {
        let eye = Vec3::new(x, 0.11 * x, DISTANCE_M);
        PinholeCamera::looking_at(eye, eye - Vec3::Z, Vec3::Y, 0.6, UVec2::splat(SIDE_PX)).into()
    })
}

/// The share of dropped samples in the middle third, which the first image sees whole.
fn left_out(image: &DepthImage) -> f64 {
    let third = SIDE_PX / 3;
    let places = (third..2 * third).flat_map(|y| (third..2 * third).map(move |x| (y * SIDE_PX + x) as usize));
    let (count, dropped) = places.fold((0, 0), |(count, dropped), index| {
        (count + 1, dropped + usize::from(image.inverse_depth_per_m[index] < 0.0))
    });
    f64::from(dropped as u32) / f64::from(count)
}

/// A wall that is turned a little, so that its rows are not those of the images.
fn wall(leg_px: f32) -> Scene {
    let pixel_m = DISTANCE_M * (0.3f32).tan() * 2.0 / SIDE_PX as f32;
    let leg_m = leg_px * pixel_m;
    let half = ((0.75 * SIDE_PX as f32 * pixel_m) / leg_m).ceil().max(1.0) as i32;
    let turn = Mat2::from_angle(0.35);
    let columns = (2 * half + 1) as u32;
    let corners = (-half..=half).flat_map(|y| (-half..=half).map(move |x| Vec2::new(x as f32, y as f32)));
    let vertices = corners.map(|corner| {
        let p = turn * ((corner + Vec2::new(0.31, 0.17)) * leg_m);
        let position = [p.x, p.y, 0.0];
        Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2], color_srgba8: [200, 200, 200, 255], sway: 0.0 }
    });
    let vertices = vertices.collect();
    let firsts = (0..columns - 1).flat_map(|y| (0..columns - 1).map(move |x| y * columns + x));
    let squares = firsts.flat_map(|a| [a, a + 1, a + columns, a + columns, a + 1, a + columns + 1]);
    let indices: Vec<u32> = squares.collect();
    let mut scene = fixtures::quad(Vec3::ZERO, 1.0, Vec3::Z, [200; 3]);
    let parts = vec![MeshPart { first_index: 0, index_count: indices.len() as u32, material: 0 }];
    scene.meshes = vec![Mesh { vertices, indices, parts, ..Mesh::default() }];
    scene
}
