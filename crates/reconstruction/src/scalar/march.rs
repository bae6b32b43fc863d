//! Twin of `march.wgsl`: a ray in the image of one sample camera alone.
//!
//! There the ray is a straight line. Columns, rows and the depth code are linear along it in one parameter `s`, 0 where
//! the march begins and 1 where it ends.

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::{
    sample_camera::{Corners, SampleCamera},
    surface::bilinear,
    view_ray::ViewRay,
};
use crate::{
    bounce::BOUNCE_LEVEL,
    methods::joint_carve::march::{EYE_SHARE, MAX_COARSE_MOVES, MAX_FINE_MOVES, NUDGE_PX, START_LEVEL},
    pyramid::FIRST_SAMPLE,
    surface::HALF_CODE,
    view_work::{CELL_MARGIN_PX, FAR_AWAY},
};

/// How far the way is free, and whether it ends at a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct March {
    pub t: f32,
    pub crossed: bool,
}

/// `origin + line · s`, in columns, rows and codes.
struct Line {
    origin: Vec3,
    line: Vec3,
    /// The reciprocals of the line's columns and rows.
    inverse: Vec2,
    s_end: f32,
}

impl Line {
    fn at(&self, s: f32) -> Vec3 {
        self.origin + self.line * s
    }

    /// 1 where columns or rows grow.
    fn forwards(&self) -> Vec2 {
        Vec2::select(self.inverse.cmpgt(Vec2::ZERO), Vec2::ONE, Vec2::ZERO)
    }

    /// Where a square from `low` is left, seen from `s`.
    fn exit(&self, s: f32, low: Vec2, side: f32) -> f32 {
        let nudge = (self.forwards() * 2.0 - 1.0) * NUDGE_PX;
        let leave = (low + self.forwards() * side + nudge - self.origin.xy()) * self.inverse;
        leave.min_element().max(s).min(self.s_end)
    }
}

pub(super) fn march(camera: &SampleCamera, ray: &ViewRay, near: f32) -> March {
    let [a, b] = ray.in_image_of(camera);
    let far = ray.far.max(near);
    let p0 = a + b * near;
    // The line ends before the plane through the camera's eye.
    let end = if b.z < 0.0 { far.min((EYE_SHARE * p0.z - a.z) * safe_reciprocal(b.z)) } else { far };
    let p1 = a + b * end;
    let [origin, to] = [p0, p1].map(|p| (p.xy() / p.z - 0.5).extend(camera.code(p.z.recip())));
    let line = to - origin;
    if !(p0.z > 0.0 && origin.xy().cmpge(Vec2::ZERO).all() && origin.xy().cmplt(camera.cells).all()) {
        return March { t: near, crossed: false };
    }
    let inverse = line.xy().map(|c| if c.abs() < 1e-9 { 1e9 } else { c.recip() });
    let border = (Vec2::select(inverse.cmpgt(Vec2::ZERO), camera.cells, Vec2::ZERO) - origin.xy()) * inverse;
    let line = Line { origin, line, inverse, s_end: border.min_element().min(1.0) };
    let (s, blocked) = march_nodes(camera, &line, ray.is_mirrored);
    let (s, crossed) = if blocked { march_cells(camera, &line, s) } else { (s, false) };
    // Back to the ray's own parameter: 1/w is linear in s.
    let share = s * p0.z / ((1.0 - s) * p1.z + s * p0.z);
    March { t: near + (end - near) * share, crossed }
}

/// Through nodes in which everything is farther away; ends before 2 × 2 cells that may hold a surface.
fn march_nodes(camera: &SampleCamera, line: &Line, is_mirrored: bool) -> (f32, bool) {
    let start_level = if is_mirrored { BOUNCE_LEVEL } else { START_LEVEL }.min(camera.top_level());
    let mut s = 0.0f32;
    let mut level = start_level;
    for _ in 0..MAX_COARSE_MOVES {
        if s >= line.s_end {
            break;
        }
        let at = line.at(s);
        let node = at.xy().max(Vec2::ZERO).min(camera.cells).as_uvec2() >> level;
        let side = (1u32 << level) as f32;
        let exit = line.exit(s, node.as_vec2() * side, side);
        let (nearest, _) = camera.range(level, node);
        if at.z.min(line.at(exit).z) > nearest || nearest < FIRST_SAMPLE {
            s = exit;
            level = (level + 1).min(start_level);
            continue;
        }
        // Free up to the depth of the nearest thing in the node.
        if at.z > nearest && line.line.z < 0.0 {
            s = ((nearest - line.origin.z) * safe_reciprocal(line.line.z)).max(s).min(exit);
        }
        if level == 1 {
            return (s, true);
        }
        level -= 1;
    }
    (s, false)
}

/// From cell to cell, to where the ray crosses the surface or is found behind it.
fn march_cells(camera: &SampleCamera, line: &Line, mut s: f32) -> (f32, bool) {
    for _ in 0..MAX_FINE_MOVES {
        if s >= line.s_end {
            break;
        }
        let at = line.at(s);
        let cell = at.xy().max(Vec2::ZERO).min(camera.cells - CELL_MARGIN_PX).floor();
        let exit = line.exit(s, cell, 1.0);
        let beyond = line.at(exit);
        let corners = camera.corners(cell.as_uvec2());
        if !corners.certain {
            break;
        }
        let here = HALF_CODE + at.z - surface_code(corners, at.xy() - cell);
        let inside_beyond = (beyond.xy() - cell).clamp(Vec2::ZERO, Vec2::ONE);
        let there = HALF_CODE + beyond.z - surface_code(corners, inside_beyond);
        if here <= 0.0 {
            break;
        }
        if there <= 0.0 {
            return (s + (exit - s) * here / (here - there).max(1e-9), true);
        }
        s = exit;
    }
    (s, false)
}

/// A silhouette runs through a cell that is not connected: what is nearer counts until the cameras vote. Before the
/// background all is free, however far beyond the samples of its image.
fn surface_code(corners: Corners, at: Vec2) -> f32 {
    let code =
        if corners.connected { bilinear(corners.codes, at) } else { corners.codes.into_iter().fold(0.0, f32::max) };
    if code < FIRST_SAMPLE { -FAR_AWAY } else { code }
}

pub(super) fn safe_reciprocal(v: f32) -> f32 {
    if v.abs() < 1e-20 { 1e20 } else { v.recip() }
}
