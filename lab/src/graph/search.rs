//! The search of a ray in an image of a graph camera (Rosen et al., section 5.1): from frusta to frusta, in each along a straight line of
//! the image, in coarse steps and in fine ones where a coarse step may meet the surface.

use depth_image::Ray;
use glam::{DVec2, DVec3, UVec2, Vec3};

use super::camera::Frustum;
use super::image::{CORNERS, GraphImage, Part, Sample};

/// The thickness of surfaces that are not connected, in footprints.
const THICKNESS_FOOTPRINTS: f64 = 2.0;
/// Connected surfaces are met between two looks no farther apart than this, in fine steps.
const LONGEST_STEP: f64 = 4.0;
const MAX_STEPS: u32 = 4096;
/// The greatest ratio of the depths of a disc's places.
const LONGEST_DISC: f64 = 4.0;

/// The steps of a search, in texels.
#[derive(Debug, Clone, Copy)]
pub struct GraphSearch {
    pub coarse_px: f64,
    pub fine_px: f64,
}

/// The end of a ray.
#[derive(Debug, Clone, Copy)]
pub struct GraphEnd {
    pub met: Option<GraphHit>,
    /// Looks at the image.
    pub steps: u32,
}

/// The surface that a ray meets.
#[derive(Debug, Clone, Copy)]
pub struct GraphHit {
    pub way_m: f64,
    pub color_linear: Vec3,
    pub normal_in_world: DVec3,
}

/// The part of a ray in one frustum: column, row and 1/w are linear in s from 0 to 1.
struct Seen<'i> {
    image: &'i GraphImage<'i>,
    number: usize,
    frustum: &'i Frustum,
    part: &'i Part,
    origin: DVec3,
    line: DVec3,
    span_m: [f64; 2],
    w_m: [f64; 2],
}

/// The image at a place of the line.
#[derive(Clone, Copy)]
struct Look {
    pixel: DVec2,
    /// The ray's inverse w less that of the surface: positive before the surface.
    gap: f64,
    /// Not too far behind the surface to have met it.
    is_near: bool,
    /// What a surface of 45° rises in a texel.
    rise: f64,
    connected: bool,
}

struct Walk {
    met_at: Option<f64>,
    steps: u32,
    last: Look,
}

impl GraphImage<'_> {
    /// The end of a ray with a direction of unit length, from `near_m` on.
    pub fn follow(&self, ray: &Ray, near_m: f64, search: GraphSearch) -> GraphEnd {
        let mut end = GraphEnd { met: None, steps: 0 };
        let mut before: Option<Look> = None;
        for seen in self.straight_parts(ray, near_m) {
            let walk = seen.walk(search, before);
            end.steps += walk.steps;
            if let Some(s) = walk.met_at {
                end.met = Some(seen.hit(s));
                break;
            }
            before = Some(walk.last);
        }
        end
    }

    /// In the order in which the ray enters the frusta.
    fn straight_parts(&self, ray: &Ray, near_m: f64) -> Vec<Seen<'_>> {
        let origin = ray.origin_in_world.as_dvec3();
        let direction = ray.direction_in_world.as_dvec3();
        let frusta = self.camera.frusta.iter().enumerate();
        let mut parts: Vec<Seen<'_>> = frusta
            .filter_map(|(number, frustum)| {
                let span_m = frustum.span(origin, direction, [near_m, f64::INFINITY])?;
                let part = &self.parts[self.camera.part(number)];
                let ends = span_m.map(|way_m| frustum.homogeneous(origin + direction * way_m));
                let [start, end] = ends.map(|at| at.truncate().extend(1.0) / at.z.max(f64::MIN_POSITIVE));
                let w_m = ends.map(|at| at.z);
                Some(Seen { image: self, number, frustum, part, origin: start, line: end - start, span_m, w_m })
            })
            .collect();
        parts.sort_by(|a, b| a.span_m[0].total_cmp(&b.span_m[0]));
        parts
    }
}

impl Seen<'_> {
    fn at(&self, s: f64) -> DVec3 {
        self.origin + self.line * s
    }

    /// In texels from the middle of the first, within the image.
    fn place(&self, s: f64) -> DVec2 {
        let last = (self.part.size_px.as_dvec2() - 1.0).max(DVec2::ZERO);
        (self.at(s).truncate() - 0.5).clamp(DVec2::ZERO, last)
    }

    fn look(&self, s: f64) -> Look {
        let at = self.at(s);
        let place = self.place(s);
        let cell = cell_of(place, self.part);
        let corners = self.part.corners(cell);
        let within = place - cell.as_dvec2();
        let rise = at.z * self.frustum.footprint();
        let look =
            Look { pixel: at.truncate(), gap: 0.0, is_near: false, rise, connected: self.part.is_connected(cell) };
        if look.connected && corners.iter().flatten().any(|sample| self.has(sample)) {
            let codes = [0, 1, 2, 3].map(|corner| self.code(corners[corner], cell + CORNERS[corner]));
            let surface: f64 = codes.into_iter().zip(shares(within)).map(|(code, share)| code * share).sum();
            let gap = at.z - surface;
            return Look { gap, is_near: gap >= -THICKNESS_FOOTPRINTS * rise, ..look };
        }
        let corner = nearest(within);
        match corners[corner] {
            Some(sample) if self.has(&sample) => self.look_at_one(look, at, &sample, cell + CORNERS[corner]),
            // The texel's ray ends before this frustum, all of which is hidden.
            Some(sample) if self.frustum.is_behind(sample.frustum()) => Look { gap: f64::NEG_INFINITY, ..look },
            // It goes on behind this frustum.
            _ => Look { gap: f64::INFINITY, is_near: true, ..look },
        }
    }

    /// Whether a sample lies in this frustum.
    fn has(&self, sample: &Sample) -> bool {
        sample.frustum() == self.number
    }

    /// A sample for itself: a disc in its tangent plane.
    fn look_at_one(&self, look: Look, at: DVec3, sample: &Sample, texel: UVec2) -> Look {
        let eye = self.frustum.eye_in_world;
        let code = f64::from(sample.inverse_w_per_m);
        let normal = sample.normal_in_world();
        let point = self.image.point(sample, texel);
        let direction = self.frustum.direction(at.truncate());
        let in_plane = normal.dot(direction) / normal.dot(point - eye);
        // No plane through the eye, and no disc that goes on without end.
        let is_disc = in_plane > code / LONGEST_DISC && in_plane < code * LONGEST_DISC;
        let gap = at.z - if is_disc { in_plane } else { code };
        let from_plane_m = normal.dot(eye + direction / at.z - point).abs();
        Look { gap, is_near: from_plane_m <= THICKNESS_FOOTPRINTS * look.rise / at.z.powi(2), ..look }
    }

    /// The inverse w of a sample in this frustum's own measure, also where it lies in the next.
    fn code(&self, sample: Option<Sample>, texel: UVec2) -> f64 {
        match sample {
            Some(sample) if self.has(&sample) => f64::from(sample.inverse_w_per_m),
            Some(sample) => self.frustum.homogeneous(self.image.point(&sample, texel)).z.recip(),
            None => 0.0,
        }
    }

    /// The ray's own parameter: 1/w is linear in s.
    fn way_m(&self, s: f64) -> f64 {
        let [near_m, far_m] = self.w_m;
        let share = s * near_m / ((1.0 - s) * far_m + s * near_m);
        self.span_m[0] + (self.span_m[1] - self.span_m[0]) * share
    }

    /// Interpolates between the samples of a connected cell, and takes the nearest one elsewhere.
    fn hit(&self, s: f64) -> GraphHit {
        let place = self.place(s);
        let cell = cell_of(place, self.part);
        let within = place - cell.as_dvec2();
        let shares = if self.part.is_connected(cell) { shares(within) } else { nearest_alone(within) };
        let mut color_linear = Vec3::ZERO;
        let mut normal = DVec3::ZERO;
        for (sample, share) in self.part.corners(cell).into_iter().zip(shares) {
            if let Some(sample) = sample.filter(|_| share > 0.0) {
                color_linear += sample.color_linear() * share as f32;
                normal += sample.normal_in_world() * share;
            }
        }
        GraphHit { way_m: self.way_m(s), color_linear, normal_in_world: normal.normalize_or_zero() }
    }

    /// `before` is the last look in the frustum that the ray comes from.
    fn walk(&self, search: GraphSearch, before: Option<Look>) -> Walk {
        let chord_px = self.line.truncate().length();
        let fine_steps = (search.coarse_px / search.fine_px).ceil().max(1.0);
        let coarse_step = (search.coarse_px / chord_px.max(1e-3)).min(1.0);
        let fine_px = search.coarse_px / fine_steps;
        let mut here = self.look(0.0);
        let mut s = 0.0;
        let mut steps = 1;
        let mut to_go = 0;
        if before.is_some_and(|before| before.gap > 0.0 && here.gap <= 0.0 && here.is_near) {
            return Walk { met_at: Some(0.0), steps, last: here };
        }
        while s < 1.0 && steps < MAX_STEPS {
            let is_coarse = to_go == 0;
            let next_s = (s + if is_coarse { coarse_step } else { coarse_step / fine_steps }).min(1.0);
            let next = self.look(next_s);
            steps += 1;
            if is_coarse && fine_steps > 1.0 && may_meet(here, next, search.coarse_px) {
                to_go = fine_steps as u32;
                continue;
            }
            to_go = u32::max(to_go, 1) - 1;
            if (!is_coarse || fine_steps <= 1.0) && meets(here, next, fine_px) {
                return Walk { met_at: Some(crossing(here, next, s, next_s)), steps, last: next };
            }
            s = next_s;
            here = next;
        }
        Walk { met_at: None, steps, last: here }
    }
}

fn may_meet(a: Look, b: Look, coarse_px: f64) -> bool {
    let fuzzy = 0.5 * coarse_px * a.rise.max(b.rise);
    a.gap.min(b.gap) <= fuzzy && a.gap.max(b.gap) >= -fuzzy
}

fn meets(a: Look, b: Look, fine_px: f64) -> bool {
    let goes_on = a.connected && b.connected && a.pixel.distance(b.pixel) <= LONGEST_STEP * fine_px;
    a.gap > 0.0 && b.gap <= 0.0 && (b.is_near || goes_on)
}

/// Where the gap changes its sign. A gap without end says nothing of the place.
fn crossing(here: Look, next: Look, s: f64, next_s: f64) -> f64 {
    let share = if here.gap.is_finite() && next.gap.is_finite() { here.gap / (here.gap - next.gap) } else { 1.0 };
    s + (next_s - s) * share.clamp(0.0, 1.0)
}

fn cell_of(place: DVec2, part: &Part) -> UVec2 {
    place.as_uvec2().min(part.size_px.saturating_sub(UVec2::splat(2)))
}

fn nearest(within: DVec2) -> usize {
    usize::from(within.x >= 0.5) + 2 * usize::from(within.y >= 0.5)
}

/// All of the nearest corner.
fn nearest_alone(within: DVec2) -> [f64; 4] {
    let mut shares = [0.0; 4];
    shares[nearest(within)] = 1.0;
    shares
}

/// The share of each corner, in the order of [`CORNERS`].
fn shares(at: DVec2) -> [f64; 4] {
    [(1.0 - at.x) * (1.0 - at.y), at.x * (1.0 - at.y), (1.0 - at.x) * at.y, at.x * at.y]
}

#[cfg(test)]
#[path = "search_tests.rs"]
mod tests;
