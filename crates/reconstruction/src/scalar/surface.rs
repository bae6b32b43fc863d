//! Twin of `surface.wgsl`: what the cameras together say of a point, its colour and whether it is occupied.

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::sample_camera::{CORNERS, SampleCamera};
use super::{pixel::Pixel, view_ray::ViewRay};
use crate::{
    pyramid::FIRST_SAMPLE,
    surface::{ANGLE_FLOOR, BORDER_PX, CARVING_SHARE, HIDDEN_WEIGHT, LEAST_SHARE, THICKNESS_FOOTPRINTS, WHOLE},
    view_work::CELL_MARGIN_PX,
};

/// Between four corners, in their order.
pub(super) fn bilinear(corners: [f32; 4], at: Vec2) -> f32 {
    let upper = corners[0] + (corners[1] - corners[0]) * at.x;
    let lower = corners[2] + (corners[3] - corners[2]) * at.x;
    upper + (lower - upper) * at.y
}

/// The share of each corner, in their order.
pub(super) fn bilinear_shares(at: Vec2) -> [f32; 4] {
    [(1.0 - at.x) * (1.0 - at.y), at.x * (1.0 - at.y), (1.0 - at.x) * at.y, at.x * at.y]
}

/// The cameras' colour of a point. `occupied`: they together hold that there is a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blend {
    pub color_linear: Vec3,
    pub camera_mask: u32,
    pub occupied: bool,
    /// The share of the camera with the lowest bit; `None` where a texel around the point lies on another surface.
    pub lowest_share: Option<f32>,
}

impl Blend {
    pub fn pixel_at(self, t: f32) -> Pixel {
        Pixel { lowest_share: self.lowest_share, ..Pixel::hit(self.color_linear, t, self.camera_mask) }
    }
}

/// One camera's vote on a point.
#[derive(Debug, Clone, Copy)]
struct CameraVote {
    /// How much its colour counts.
    weight: f32,
    color_linear: Vec3,
    mask: u32,
    /// What the texels whose colours count amount to.
    own: f32,
    /// Share of the texels around that lie on the point's own surface, or show what is beyond it.
    same: f32,
    beyond: f32,
}

/// The two cameras that know a point best, each weighted by how far it surpasses the third (Buehler et al.
/// 2001, with k = 2).
pub(super) fn blend_two_best(cameras: &[SampleCamera], ray: &ViewRay, t: f32) -> Blend {
    let point = ray.at(t);
    let view_direction = ray.direction.normalize_or(Vec3::NEG_Z);
    let votes: Vec<CameraVote> = cameras.iter().map(|camera| vote(camera, point, view_direction)).collect();
    let mut best_first = votes.clone();
    best_first.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    let third_weight = best_first.get(2).map_or(0.0, |s| s.weight);
    let first = best_first[0];
    let surplus: Vec<f32> = best_first.iter().map(|vote| (vote.weight - third_weight).max(0.0)).collect();
    let mut weights = surplus[0] + 1e-9;
    let mut color = first.color_linear * (surplus[0] + 1e-9);
    let mut camera_mask = if first.weight > 0.0 { first.mask } else { 0 };
    if let Some(second) = best_first.get(1) {
        color += second.color_linear * surplus[1];
        weights += surplus[1];
        camera_mask |= if second.weight > third_weight { second.mask } else { 0 };
    }
    let [same, beyond]: [f32; 2] = [votes.iter().map(|s| s.same).sum(), votes.iter().map(|s| s.beyond).sum()];
    let carved = votes.iter().any(|s| s.beyond > CARVING_SHARE);
    Blend {
        color_linear: color / weights,
        camera_mask,
        occupied: same >= beyond && camera_mask != 0 && !carved,
        lowest_share: lowest_share(&best_first, camera_mask, surplus[0] / weights),
    }
}

/// To one of 254 parts, as provenance says it.
fn lowest_share(best_first: &[CameraVote], camera_mask: u32, share: f32) -> Option<f32> {
    let first = &best_first[0];
    let is_single = camera_mask == first.mask;
    let is_whole = first.own > WHOLE && (is_single || best_first.get(1).is_some_and(|second| second.own > WHOLE));
    let share = if camera_mask.trailing_zeros() == first.mask.trailing_zeros() { share } else { 1.0 - share };
    is_whole.then_some((share * 254.0).round() / 254.0)
}

fn faded(share: f32) -> f32 {
    ((share - LEAST_SHARE) / (1.0 - LEAST_SHARE)).clamp(0.0, 1.0)
}

fn vote(camera: &SampleCamera, point_in_world: Vec3, view_direction: Vec3) -> CameraVote {
    let p = camera.homogeneous(point_in_world.extend(1.0));
    let inverse_w = p.z.recip();
    let uv = p.xy() * inverse_w - 0.5;
    if !(p.z > 0.0 && uv.cmpge(Vec2::ZERO).all() && uv.cmplt(camera.cells).all()) {
        return CameraVote {
            weight: 0.0,
            color_linear: Vec3::ZERO,
            mask: camera.mask,
            own: 0.0,
            same: 0.0,
            beyond: 0.0,
        };
    }
    let clamped = uv.min(camera.cells - CELL_MARGIN_PX);
    let cell = clamped.as_uvec2();
    let at = clamped - clamped.floor();
    let corners = camera.corners(cell);
    let reach = THICKNESS_FOOTPRINTS * camera.code_above(inverse_w) / camera.focal_px;
    // In a connected cell the surface itself counts, else each sample for itself.
    let surfaces = if corners.connected { [bilinear(corners.codes, at); 4] } else { corners.codes };
    let mut same = 0.0;
    let mut beyond = 0.0;
    let mut color = Vec3::ZERO;
    // On the same surface: shares that count, and shares whose ways are proven free.
    let mut own = 0.0;
    let mut proven = 0.0;
    for (i, share) in bilinear_shares(at).into_iter().enumerate() {
        let gap = camera.code(inverse_w) - surfaces[i];
        let is_sample = corners.codes[i] > FIRST_SAMPLE;
        if gap.abs() < reach && is_sample {
            same += share;
            proven += share * corners.proven[i];
            let counted = share * if corners.proven[i] > 0.0 { 1.0 } else { HIDDEN_WEIGHT };
            own += counted;
            color += camera.color_linear(cell + CORNERS[i]) * counted;
        }
        if (gap > reach || !is_sample) && corners.codes[i] > 0.5 && corners.certain {
            beyond += share;
        }
    }
    let fade = if camera.among_holes { faded(proven) + HIDDEN_WEIGHT * faded(same) } else { 1.0 };
    let of: f32 = if camera.among_holes { own.max(1e-6) } else { same.max(LEAST_SHARE) };
    let weight = if same > LEAST_SHARE { weight(camera, uv, point_in_world, view_direction) * fade } else { 0.0 };
    CameraVote { weight, color_linear: color / of, mask: camera.mask, own, same, beyond }
}

/// By the angle between the two lines of sight, the footprint and the distance to the border.
fn weight(camera: &SampleCamera, uv: Vec2, point_in_world: Vec3, view_direction: Vec3) -> f32 {
    let eye_to_point = point_in_world - camera.eye_in_world;
    let inverse_distance = eye_to_point.length().recip();
    let off = eye_to_point * inverse_distance - view_direction;
    let border = (uv.min(camera.cells - uv).min_element() / BORDER_PX).min(1.0) + 1e-3;
    let footprint = camera.focal_px * inverse_distance;
    border * footprint * footprint / (off.length_squared() + ANGLE_FLOOR)
}
