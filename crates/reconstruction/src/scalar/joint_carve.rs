//! Twin of `joint_carve.wgsl`: one ray, a pyramid for each camera, one parameter t.

use depth_image::ProvenanceKind;
use glam::{UVec2, Vec2, Vec3, Vec3Swizzles};

use super::{
    march::{march, safe_reciprocal},
    pixel::Pixel,
    sample_camera::{Corners, SampleCamera},
    surface::{bilinear, bilinear_shares, blend_two_best},
    view_ray::ViewRay,
};
use crate::{
    bounce::BOUNCE_LEVEL,
    methods::joint_carve::{
        BLIND_MOVE, LEAST_MOVE, MAX_MOVES, MAX_MOVES_TO_HIT,
        march::{MARCHES, NUDGE_PX, START_LEVEL},
    },
    pyramid::FIRST_SAMPLE,
    surface::{HALF_CODE, THICKNESS_FOOTPRINTS},
    view_work::FAR_AWAY,
};

/// A camera's knowledge of the ray from t on; the shader's `Evaluation`.
#[derive(Debug, Clone, Copy)]
struct Evaluation {
    /// The way is free up to here (t where nothing is proven).
    free_until: f32,
    /// Where the ray leaves the node.
    exit: f32,
    /// In footprints, positive inside the surface; far away where not inside or where only its back is met.
    penetration: f32,
    /// Finer levels could say more.
    undecided: bool,
    /// Share of the texels around that lie on one surface with the ray, less the share that show what is
    /// beyond it.
    vote: f32,
}

/// From a camera that does not see the point.
const UNSEEN: Evaluation =
    Evaluation { free_until: -1.0, exit: FAR_AWAY, penetration: FAR_AWAY, undecided: false, vote: 0.0 };

/// A ray in a camera's image at t, within one node of the pyramid.
struct InNode {
    t: f32,
    exit: f32,
    /// Planar, at t and at the exit.
    depths_m: [f32; 2],
    code: f32,
    exit_code: f32,
    /// From the node's upper left corner, in pixels, at t and at the exit.
    at: Vec2,
    exit_at: Vec2,
}

impl InNode {
    /// The parameter at a share of the way in the image: codes are linear there, not in t.
    fn at_share(&self, share: f32) -> f32 {
        let weights = [(1.0 - share) / self.depths_m[0], share / self.depths_m[1].max(1e-20)];
        (weights[0] * self.t + weights[1] * self.exit) / (weights[0] + weights[1])
    }
}

/// Marches in the nearest cameras, one after another; what they leave is carved by all together.
pub(super) fn joint_carve(cameras: &[SampleCamera], ray: &ViewRay, start: f32, stop_level: u32) -> Pixel {
    let mut t = ray.near.max(start);
    for marched in cameras.iter().take(MARCHES) {
        if t >= ray.far {
            return Pixel::without_surface(ProvenanceKind::Empty);
        }
        let found = march(marched, ray, t);
        t = found.t;
        let blend = blend_two_best(cameras, ray, t);
        if found.crossed && blend.occupied {
            return blend.pixel_at(t);
        }
    }
    carve(cameras, ray, t, stop_level)
}

/// All cameras together, from where the marches ended.
pub(super) fn carve(cameras: &[SampleCamera], ray: &ViewRay, begin: f32, stop_level: u32) -> Pixel {
    let start_level = if ray.is_mirrored { BOUNCE_LEVEL } else { START_LEVEL }.max(stop_level);
    let mut t = begin;
    let mut level = start_level;
    let mut hit = false;
    let mut known = true;
    // A ray that begins on a surface which its images show does not meet it: the way must have been free.
    let mut freed = !ray.is_mirrored || begin > ray.near;
    let among_holes = cameras.iter().any(|camera| camera.among_holes);
    let moves_to_hit = if ray.is_mirrored || among_holes { MAX_MOVES } else { MAX_MOVES_TO_HIT };
    for number in 0..MAX_MOVES {
        let may_hit = number < moves_to_hit;
        if t >= ray.far || !(known || may_hit) {
            break;
        }
        let evaluations: Vec<Evaluation> =
            cameras.iter().map(|c| evaluate_camera(c, ray, t, level, stop_level)).collect();
        let free = evaluations.iter().any(|v| v.free_until == v.exit && v.free_until > t);
        let (free_until, penetration) = joined(&evaluations, t);
        freed |= free_until > t;
        let descend = !free && level > stop_level && evaluations.iter().any(|v| v.undecided);
        let candidate = !free && !descend && penetration < THICKNESS_FOOTPRINTS && may_hit;
        // First go to the very place, then let the cameras vote there.
        let arrived = free_until <= t || stop_level > 0;
        hit = candidate && arrived && freed && evaluations.iter().map(|v| v.vote).sum::<f32>() >= 0.0;
        let unknown = !free && !descend && !candidate;
        known &= !unknown;
        t = if unknown || (candidate && arrived && !hit) {
            let exit = evaluations.iter().fold(FAR_AWAY, |least, v| least.min(v.exit));
            let beyond = if exit >= FAR_AWAY { t + (ray.far - ray.near) * BLIND_MOVE } else { exit };
            beyond.max(t * LEAST_MOVE)
        } else {
            free_until
        };
        level = match (candidate, descend) {
            (true, _) => stop_level,
            (false, true) => level - 1,
            (false, false) => (level + 1).min(start_level),
        };
        if hit {
            break;
        }
    }
    let blend = blend_two_best(cameras, ray, t);
    if hit && blend.camera_mask != 0 {
        return blend.pixel_at(t);
    }
    let empty = !hit && known && t >= ray.far;
    Pixel::without_surface(if empty { ProvenanceKind::Empty } else { ProvenanceKind::Filled })
}

/// How far the way is free for any camera, and the least penetration. A crossing farther on than the
/// others' outweighs them: they are inside there.
fn joined(evaluations: &[Evaluation], t: f32) -> (f32, f32) {
    evaluations.iter().fold((t, FAR_AWAY), |(free_until, penetration), v| {
        let penetration = if v.free_until > free_until { v.penetration } else { penetration.min(v.penetration) };
        (free_until.max(v.free_until), penetration)
    })
}

fn evaluate_camera(camera: &SampleCamera, ray: &ViewRay, t: f32, level: u32, stop_level: u32) -> Evaluation {
    let [a, b] = ray.in_image_of(camera);
    let p = a + b * t;
    let uv = p.xy() / p.z - 0.5;
    if !(p.z > 0.0 && uv.cmpge(Vec2::ZERO).all() && uv.cmplt(camera.cells).all()) {
        return UNSEEN;
    }
    // A small image has fewer levels.
    let pyramid_level = level.min(camera.top_level());
    let node = uv.as_uvec2() >> pyramid_level;
    let low = (node << pyramid_level).as_vec2();
    let high = (low + (1u32 << pyramid_level) as f32).min(camera.cells);
    let exit = exit([a, b], p, [low, high]).max(t).min(ray.far);
    let exit_p = a + b * exit;
    let within = InNode {
        t,
        exit,
        depths_m: [p.z, exit_p.z],
        code: camera.code(p.z.recip()),
        exit_code: if exit_p.z <= 0.0 { 1e9 } else { camera.code(exit_p.z.recip()) },
        at: uv - low,
        exit_at: (exit_p.xy() / exit_p.z - 0.5 - low).max(Vec2::ZERO).min(Vec2::ONE),
    };
    if level > 0 {
        let penetration_inside = if level == stop_level { 0.0 } else { FAR_AWAY };
        evaluate_node(camera, &within, [a, b], pyramid_level, node, penetration_inside)
    } else {
        let corners = camera.corners(node);
        if corners.certain || corners.connected {
            return evaluate_cell(camera, &within, corners);
        }
        evaluate_quarter(camera, ray, within, low, corners)
    }
}

/// Between unconnected samples of which some are uncertain each stands for its own quarter of the cell.
fn evaluate_quarter(camera: &SampleCamera, ray: &ViewRay, cell: InNode, low: Vec2, corners: Corners) -> Evaluation {
    let [a, b] = ray.in_image_of(camera);
    let quarter = (cell.at * 2.0).floor();
    let edges = [low + 0.5 * quarter, (low + 0.5 * quarter + 0.5).min(camera.cells)];
    let exit = exit([a, b], a + b * cell.t, edges).max(cell.t).min(ray.far);
    let exit_p = a + b * exit;
    let own = corners.codes[usize::from(quarter.x > 0.5) + 2 * usize::from(quarter.y > 0.5)];
    if own < 0.5 {
        return Evaluation { free_until: cell.t, exit, penetration: FAR_AWAY, undecided: false, vote: 0.0 };
    }
    let within = InNode {
        exit,
        depths_m: [cell.depths_m[0], exit_p.z],
        exit_code: if exit_p.z <= 0.0 { 1e9 } else { camera.code(exit_p.z.recip()) },
        exit_at: (exit_p.xy() / exit_p.z - 0.5 - low).max(Vec2::ZERO).min(Vec2::ONE),
        ..cell
    };
    evaluate_cell(camera, &within, Corners { codes: [own; 4], ..corners })
}

/// Where the ray leaves the rectangle. One through the camera's own eye stays in one place and leaves none.
fn exit([a, b]: [Vec3; 2], p: Vec3, [low, high]: [Vec2; 2]) -> f32 {
    let turn = b.xy() * p.z - p.xy() * b.z;
    let edge = Vec2::select(turn.cmpgt(Vec2::ZERO), high + NUDGE_PX, low - NUDGE_PX) + 0.5;
    let slope = (b.xy() - edge * b.z).map(|s| if s.abs() < 1e-20 { 1e-20 } else { s });
    let leave = (edge * a.z - a.xy()) / slope;
    // A ray whose vanishing point lies in the rectangle does not leave it.
    let leaves = turn.abs().cmpgt(Vec2::splat(1e-12)) & (slope * turn).cmpgt(Vec2::ZERO);
    Vec2::select(leaves, leave, Vec2::splat(FAR_AWAY)).min_element()
}

/// By the range of depths in a node of level 1 or coarser.
fn evaluate_node(
    camera: &SampleCamera,
    within: &InNode,
    [a, b]: [Vec3; 2],
    level: u32,
    node: UVec2,
    penetration_inside: f32,
) -> Evaluation {
    let &InNode { t, exit, code, exit_code, .. } = within;
    let (nearest, farthest) = camera.range(level, node);
    if code.min(exit_code) > nearest || nearest < FIRST_SAMPLE {
        return Evaluation { free_until: exit, exit, penetration: FAR_AWAY, undecided: false, vote: 0.0 };
    }
    // Free up to the depth of the nearest thing in the node.
    let surface_t = (camera.inverse_depth_per_m(nearest).recip() - a.z) * safe_reciprocal(b.z);
    let free_until = if code > nearest && nearest > 1.0 { surface_t.max(t).min(exit) } else { t };
    let slack = THICKNESS_FOOTPRINTS * (code.max(exit_code) - camera.code_offset()) / camera.focal_px;
    let behind = code.max(exit_code) + slack < farthest && farthest > FIRST_SAMPLE;
    let penetration = if behind { FAR_AWAY } else { penetration_inside };
    Evaluation { free_until, exit, penetration, undecided: !behind, vote: 1.0 }
}

/// By the patch or the four samples of one cell.
fn evaluate_cell(camera: &SampleCamera, within: &InNode, corners: Corners) -> Evaluation {
    let &InNode { t, exit, code, exit_code, at, exit_at, .. } = within;
    let nothing = Evaluation { free_until: t, exit, penetration: FAR_AWAY, undecided: false, vote: 0.0 };
    // A connected cell is its bilinear surface; else each sample is a surface of its own.
    let own = corners.codes.map(|code| if code < FIRST_SAMPLE { -FAR_AWAY } else { code });
    let [gaps, gaps_at_exit] = [(at, code), (exit_at, exit_code)].map(|(at, code)| {
        let samples = if corners.connected { [bilinear(corners.codes, at); 4] } else { own };
        samples.map(|sample| HALF_CODE + code - sample)
    });
    let ahead: Vec<usize> = (0..4).filter(|&i| gaps[i] > 0.0).collect();
    // The nearest of the surfaces still ahead is met first.
    let next_gap = ahead.iter().fold(FAR_AWAY, |least, &i| least.min(gaps[i]));
    let next_gap_at_exit = next_gap + ahead.iter().fold(FAR_AWAY, |least, &i| least.min(gaps_at_exit[i] - gaps[i]));
    let meets = !ahead.is_empty() && next_gap_at_exit <= 0.0;
    let share = next_gap / (next_gap - next_gap_at_exit).max(1e-9);
    let crossing = if meets { within.at_share(share.clamp(0.0, 1.0)) } else { exit };
    if ahead.len() == 4 && !corners.certain {
        // Nothing is proven up to the sample, but the ray may meet it.
        return Evaluation { exit: crossing, ..nothing };
    }
    if ahead.len() == 4 {
        let (exit, penetration) = if meets { (crossing + (exit - t) * 1e-6, 0.0) } else { (exit, FAR_AWAY) };
        return Evaluation { free_until: crossing, exit, penetration, ..nothing };
    }
    let footprint = (code - camera.code_offset()) / camera.focal_px;
    let reach = THICKNESS_FOOTPRINTS * footprint;
    let votes = bilinear_shares(at).into_iter().enumerate().map(|(i, share)| match gaps[i] {
        gap if gap > reach && corners.certain => -share,
        gap if gap.abs() < reach && corners.codes[i] > FIRST_SAMPLE => share,
        _ => 0.0,
    });
    // Inside and on the way out of a connected cell: the back of the surface, which no camera saw.
    let leaving = corners.connected && gaps_at_exit[0] > gaps[0];
    let shallowest = gaps.iter().filter(|&&gap| gap <= 0.0).fold(FAR_AWAY, |least, &gap| least.min(-gap));
    Evaluation {
        free_until: t,
        exit: crossing,
        penetration: if leaving { FAR_AWAY } else { shallowest / footprint },
        undecided: false,
        vote: votes.sum(),
    }
}
