//! Merged quads against the quads of their samples: all are covered, once, and none by more than the bound off.

use std::collections::HashMap;

use depth_image::PinholeCamera;
use glam::{UVec2, Vec2, Vec3};
use reconstruction::Quad;

use crate::{
    meshes::{HYBRID, merged},
    stage::{Stage, corpus, reconstructor},
};

const CORNERS: [UVec2; 4] = [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE];

/// A merged quad, and the samples it stands for.
struct Block<'q> {
    quad: &'q Quad,
    origin: UVec2,
    size: UVec2,
}

impl<'q> Block<'q> {
    fn of(quad: &'q Quad, camera: &PinholeCamera) -> Self {
        let [origin, last] = quad.samples.map(|i| UVec2::new(i % camera.size_px.x, i / camera.size_px.x));
        Self { quad, origin, size: last + 1 - origin }
    }

    fn texels(&self) -> impl Iterator<Item = UVec2> {
        let origin = self.origin;
        let size = self.size;
        (0..size.y).flat_map(move |y| (0..size.x).map(move |x| origin + UVec2::new(x, y)))
    }

    /// How far the quad lies behind a point, along its ray from the eye, in pixels at the point's depth.
    fn behind_px(&self, camera: &PinholeCamera, corner: UVec2, point: Vec3) -> f32 {
        let at = (corner - self.origin).as_vec2() / self.size.as_vec2();
        let [a, b, c, d] = self.quad.corners_in_world;
        let [a, b, c] = if at.element_sum() <= 1.0 { [a, b, c] } else { [d, c, b] };
        let normal = (b - a).cross(c - a);
        let sight = point - camera.eye_in_world;
        let met = normal.dot(a - camera.eye_in_world) / normal.dot(sight);
        let depth_m = sight.dot(camera.forward_in_world());
        (met - 1.0) * sight.length() * camera.focal_px.min_element() / depth_m
    }
}

/// Findings over all blocks of a set.
#[derive(Debug, Default)]
struct Found {
    samples: usize,
    greatest_error_px: f32,
    /// Between merged quads, at corners that their samples' quads share.
    greatest_crack_px: f32,
}

fn measured(stage: &Stage, px: f64) -> Found {
    let set = stage.upload();
    let read = |method| reconstructor().read_quads(&set, method).expect("quads");
    let own = read(HYBRID);
    let merged = read(merged(px));
    let own: HashMap<_, _> = own.iter().map(|quad| ((quad.image, quad.samples[0]), quad)).collect();
    let mut found = Found::default();
    let mut at_corners: HashMap<_, Vec2> = HashMap::new();
    for quad in &merged {
        let camera = stage.images[quad.image].camera.reference();
        let block = Block::of(quad, camera);
        for texel in block.texels() {
            found.samples += 1;
            let sample = (quad.image, texel.y * camera.size_px.x + texel.x);
            for (offset, point) in CORNERS.into_iter().zip(own[&sample].corners_in_world) {
                let behind_px = block.behind_px(camera, texel + offset, point);
                found.greatest_error_px = found.greatest_error_px.max(behind_px.abs());
                let place = (quad.image, texel + offset, point.to_array().map(f32::to_bits));
                let range = at_corners.entry(place).or_insert(Vec2::splat(behind_px));
                *range = Vec2::new(range.x.min(behind_px), range.y.max(behind_px));
            }
        }
    }
    assert_eq!(found.samples, own.len(), "each sample is of one quad");
    found.greatest_crack_px = at_corners.values().map(|range| range.y - range.x).fold(0.0, f32::max);
    found
}

#[test]
fn no_sample_is_off_its_merged_quad_by_more_than_the_bound() {
    for (name, scene, corners) in corpus() {
        let stage = Stage::with_corners(scene, &corners.samples(2));
        for px in [0.1, 0.5, 2.0] {
            let found = measured(&stage, px);
            println!("{name:<18} {px} px: {found:?}");
            // Points in the world are rounded.
            assert!(f64::from(found.greatest_error_px) <= px + 0.01, "{name} {px}: {found:?}");
            assert!(f64::from(found.greatest_crack_px) <= px + 0.02, "{name} {px}: {found:?}");
        }
    }
}
