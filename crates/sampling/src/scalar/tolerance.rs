//! The twin of `tolerance.wgsl`, and of the temporal reference in `known_samples.wgsl`.

use depth_image::{DepthImage, unit_from_oct16};
use glam::Vec3;
use render::scalar::REFERENCE_FOOTPRINTS;

use super::candidate::{Candidate, footprint_m, index_of, place};
use crate::methods::non_redundant::{CLEARLY, CLEARLY_SAME_FACING, COARSER, DEPTH_FOOTPRINTS, SAME_FACING, SLOPE_PX};

/// Whether an image has a sample where a candidate is.
pub(super) fn was_kept(candidate: &Candidate, reference: &DepthImage) -> bool {
    let camera = reference.camera.reference();
    let (Some((pixel, depth_m)), Some(normals)) = (place(camera, candidate.point_in_world), &reference.normal_oct16)
    else {
        return false;
    };
    let texel = pixel.as_uvec2();
    let index = index_of(camera, texel);
    let inverse_depth = reference.inverse_depth_per_m[index];
    let held_m = footprint_m(camera, texel, inverse_depth, unit_from_oct16(normals[index]));
    let room_m = REFERENCE_FOOTPRINTS * held_m.max(candidate.footprint_m);
    inverse_depth > 0.0 && (inverse_depth.recip() - depth_m).abs() < room_m
}

pub(super) fn is_tolerance_redundant(candidate: &Candidate, was_kept: bool, allowed: f32, image: &DepthImage) -> bool {
    let camera = image.camera.reference();
    let (Some((pixel, depth_m)), Some(normals)) = (place(camera, candidate.point_in_world), &image.normal_oct16) else {
        return false;
    };
    let sight = candidate.point_in_world - camera.eye_in_world;
    let steps = [Vec3::X / camera.focal_px.x, Vec3::NEG_Y / camera.focal_px.y].map(|s| camera.world_from_camera * s);
    let across: f32 = steps.iter().map(|step| candidate.normal.dot(*step).abs()).sum();
    let slope = depth_m * across / (candidate.normal.dot(sight).abs() / depth_m).max(1e-6);
    let (share, least_facing) = if was_kept { (CLEARLY, CLEARLY_SAME_FACING) } else { (1.0, SAME_FACING) };
    let allowed = share * allowed;
    let room_m = allowed * (DEPTH_FOOTPRINTS * depth_m / camera.focal_px.min_element()).max(SLOPE_PX * slope);
    let first = (pixel - 0.5).floor().as_ivec2();
    let last = camera.size_px.as_ivec2() - 1;
    let mut stand_for_it = [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().map(|(x, y)| {
        let texel = (first + glam::IVec2::new(x, y)).clamp(glam::IVec2::ZERO, last).as_uvec2();
        let index = index_of(camera, texel);
        let inverse_depth = image.inverse_depth_per_m[index];
        let normal = unit_from_oct16(normals[index]);
        inverse_depth > 0.0
            && (inverse_depth.recip() - depth_m).abs() < room_m
            && normal.dot(candidate.normal) > least_facing
            && footprint_m(camera, texel, inverse_depth, normal) <= allowed * COARSER * candidate.footprint_m
    });
    if was_kept { stand_for_it.all(|stands| stands) } else { stand_for_it.any(|stands| stands) }
}
