//! Twin of `fill.wgsl`: what no camera knows gets the colour of the farther side of its gap.

use depth_image::ProvenanceKind;
use glam::{IVec2, UVec2, Vec3};

use super::{pixel::Pixel, view_ray::places};
use crate::fill::{DIRECTIONS, REACH_PX, SAME_SIDE};

/// The first known pixel in one direction, and what it counts.
#[derive(Clone, Copy)]
struct Neighbour {
    pixel: Pixel,
    weight: f32,
}

pub(super) fn fill(pixels: &mut [Pixel], size_px: UVec2) {
    let known = pixels.to_vec();
    for (place, pixel) in places(size_px).zip(pixels) {
        if pixel.provenance.kind() == ProvenanceKind::Filled {
            let towards = DIRECTIONS.into_iter().map(IVec2::from);
            let neighbours = towards.filter_map(|towards| known_towards(&known, size_px, place.as_ivec2(), towards));
            fill_pixel(pixel, &neighbours.collect::<Vec<_>>());
        }
    }
}

fn fill_pixel(pixel: &mut Pixel, neighbours: &[Neighbour]) {
    let farthest = neighbours.iter().fold(f32::INFINITY, |least, n| least.min(n.pixel.inverse_depth_per_m));
    let far_side: Vec<_> = neighbours.iter().filter(|n| n.pixel.inverse_depth_per_m * SAME_SIDE <= farthest).collect();
    let weights: f32 = far_side.iter().map(|n| n.weight).sum();
    // Nothing is known within reach: the background stays.
    if weights > 0.0 {
        let color: Vec3 = far_side.iter().map(|n| n.pixel.color_linear * n.weight).sum();
        let depth: f32 = far_side.iter().map(|n| n.pixel.inverse_depth_per_m * n.weight).sum();
        pixel.color_linear = color / weights;
        pixel.inverse_depth_per_m = depth / weights;
    }
}

fn known_towards(known: &[Pixel], size_px: UVec2, origin: IVec2, towards: IVec2) -> Option<Neighbour> {
    for i in 1..=REACH_PX {
        let at = origin + towards * i;
        if at.cmplt(IVec2::ZERO).any() || at.cmpge(size_px.as_ivec2()).any() {
            return None;
        }
        let pixel = known[(at.y * size_px.x as i32 + at.x) as usize];
        if pixel.provenance.kind() != ProvenanceKind::Filled {
            return Some(Neighbour { pixel, weight: (i as f32 * towards.as_vec2().length()).recip() });
        }
    }
    None
}
