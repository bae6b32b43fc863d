//! Twin of `tile_start.wgsl`: how far all rays of a tile run through space that is empty or unseen.

use glam::{UVec2, Vec2, Vec3, Vec3Swizzles};

use super::{
    sample_camera::SampleCamera,
    view_ray::{ViewRay, ViewRays, places},
};
use crate::{
    pyramid::FIRST_SAMPLE,
    tile_start::{GREATEST_TILE_MOVE, HALF_DIAGONAL, LEAST_TILE_MOVE, MAX_TILE_MOVES},
    view_work::{FAR_AWAY, TILE_PX},
};

/// A camera's knowledge of a part of the way of all rays of a tile.
struct Evaluation {
    /// Each ray's point is proven empty by this camera.
    proven: bool,
    /// No point that this camera sees may be occupied; it need not see them all.
    unopposed: bool,
}

/// Row by row.
pub(super) fn tile_starts(cameras: &[SampleCamera], rays: &ViewRays) -> Vec<f32> {
    places(rays.tiles()).map(|tile| tile_start(cameras, rays, tile)).collect()
}

fn tile_start(cameras: &[SampleCamera], rays: &ViewRays, tile: UVec2) -> f32 {
    let middle = rays.ray_at((tile.as_vec2() + 0.5) * TILE_PX as f32);
    // Half a tile's diagonal at depth 1, and a little for rounding.
    let slope = HALF_DIAGONAL * TILE_PX as f32 / rays.focal_px();
    let farthest = (rays.volume.min - rays.eye()).abs().max((rays.volume.max - rays.eye()).abs()).length();
    let mut t = entry(rays, tile);
    let mut stride = GREATEST_TILE_MOVE;
    for _ in 0..MAX_TILE_MOVES {
        if t >= farthest || stride <= LEAST_TILE_MOVE {
            break;
        }
        let evaluations: Vec<Evaluation> =
            cameras.iter().map(|c| evaluate_camera(c, &middle, [t, t * stride], slope)).collect();
        if evaluations.iter().any(|o| o.proven) || evaluations.iter().all(|o| o.unopposed) {
            t *= stride;
            stride = (1.0 + (stride - 1.0) * 1.5).min(GREATEST_TILE_MOVE);
        } else {
            stride = 0.5 + 0.5 * stride;
        }
    }
    t
}

/// A disc around the middle ray bounds the points of all rays at one parameter.
fn evaluate_camera(camera: &SampleCamera, middle: &ViewRay, way: [f32; 2], slope: f32) -> Evaluation {
    let [a, b] = middle.in_image_of(camera);
    let ends = way.map(|t| a + b * t);
    let radii_m = way.map(|t| slope * t);
    let closest_m = [0, 1].map(|i| ends[i].z - radii_m[i]);
    let farthest_m = [0, 1].map(|i| ends[i].z + radii_m[i]);
    let centers_px = ends.map(|p: Vec3| p.xy() / p.z - 0.5);
    let radii_px = [0, 1].map(|i| camera.stretch * radii_m[i] / closest_m[i].max(1e-20));
    let low = (centers_px[0] - radii_px[0]).min(centers_px[1] - radii_px[1]);
    let high = (centers_px[0] + radii_px[0]).max(centers_px[1] + radii_px[1]);
    let in_front = closest_m.iter().all(|&m| m > 0.0);
    let aside = high.cmplt(Vec2::ZERO).any() || low.cmpgt(camera.cells).any();
    if farthest_m.iter().all(|&m| m <= 0.0) || (in_front && aside) {
        return Evaluation { proven: false, unopposed: true };
    }
    let first = low.max(Vec2::ZERO).min(camera.cells);
    let extent = high.max(Vec2::ZERO).min(camera.cells) - first;
    let wanted = (extent.max_element() + 1e-3).log2().ceil().max(1.0) as u32;
    let level = wanted.min(camera.top_level());
    // The coarsest nodes of a strip are shorter than it.
    let is_covered = wanted <= level;
    let nearest = camera.wide_nearest(level, first.as_uvec2() >> level);
    let farthest_code = farthest_m.map(|m| camera.code(m.max(1e-20).recip())).into_iter().fold(f32::INFINITY, f32::min);
    let empty = is_covered && in_front && (farthest_code > nearest || nearest < FIRST_SAMPLE);
    let whole = low.cmpge(Vec2::ZERO).all() && high.cmple(camera.cells).all();
    Evaluation { proven: empty && whole, unopposed: empty }
}

/// The least parameter at which a corner ray enters the volume; the near plane where a corner misses it
/// although something between may not.
fn entry(rays: &ViewRays, tile: UVec2) -> f32 {
    let corners = [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE].map(|corner| (tile + corner) * TILE_PX);
    let entries = corners.map(|pixel| {
        let ray = rays.ray_at(pixel.as_vec2());
        if ray.near <= ray.far { ray.near } else { rays.near_m() }
    });
    entries.into_iter().fold(FAR_AWAY, f32::min)
}
