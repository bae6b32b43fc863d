//! The twin of `useful.wgsl`.

use depth_image::{HOLE_INVERSE_DEPTH, PinholeCamera};
use glam::Vec2;

use super::{candidate::index_of, texel::Texel};
use crate::methods::useful::{BLOCKER_FOOTPRINTS, RING};

/// Samples behind a blocker that fills the whole ring around it are not seen from the cell: they become holes.
pub(super) fn omit_useless(texels: &mut [Texel], camera: &PinholeCamera, view_cell_m: f32) {
    let fronts = texels.iter().map(|texel| texel.passed_m.map_or(texel.inverse_depth_per_m.max(0.0), f32::recip));
    let fronts: Vec<f32> = fronts.collect();
    let width = camera.size_px.x;
    for (place, texel) in (0..).zip(texels).filter(|(_, texel)| texel.inverse_depth_per_m > 0.0) {
        let Some(blocker_m) = texel.passed_m else { continue };
        let sample_m = texel.inverse_depth_per_m.recip();
        let footprint_m = blocker_m / camera.focal_px.min_element();
        let radius_px = (view_cell_m * (sample_m - blocker_m) / sample_m / footprint_m).max(1.0);
        let center = Vec2::new((place % width) as f32, (place / width) as f32) + 0.5;
        let is_seen_past = (0..RING).any(|step| {
            let offset = Vec2::from_angle(step as f32 * std::f32::consts::TAU / RING as f32) * radius_px;
            let at = (center + offset).floor();
            let inside = at.cmpge(Vec2::ZERO).all() && at.cmplt(camera.size_px.as_vec2()).all();
            let front = if inside { fronts[index_of(camera, at.as_uvec2())] } else { 0.0 };
            front <= 0.0 || (front.recip() - blocker_m).abs() > BLOCKER_FOOTPRINTS * footprint_m
        });
        if !is_seen_past {
            texel.inverse_depth_per_m = HOLE_INVERSE_DEPTH;
        }
    }
}
