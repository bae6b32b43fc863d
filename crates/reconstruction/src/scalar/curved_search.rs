//! Twin of `bounce/curved_search.wgsl`, and the same search in steps so short that they miss nothing.

use depth_image::{Aabb, Camera, DepthImage, ProvenanceKind, Ray, SinglePoleCamera};
use glam::{Vec2, Vec3, Vec3Swizzles};

use super::march::safe_reciprocal;
use super::sample_camera::{CORNERS, SampleCamera};
use super::surface::{bilinear, bilinear_shares};
use super::view_ray::span_in;
use crate::bounce::{LONGEST_STEP, MAX_WALK_STEPS};
use crate::pyramid::FIRST_SAMPLE;
use crate::sample_set::searched_volume;
use crate::surface::{HALF_CODE, THICKNESS_FOOTPRINTS};
use crate::view_work::{CELL_MARGIN_PX, FAR_AWAY};
use crate::{CurvedSearch, RayEnd};

/// The longest step of the exhaustive search, in texels along the curve.
const EIGHTH_PX: f32 = 0.125;

/// Images of single-pole cameras.
pub struct SinglePoleImages {
    cameras: Vec<(SampleCamera, SinglePoleCamera)>,
    volume: Aabb,
}

impl SinglePoleImages {
    /// Of images within a volume; those of pinholes are left out.
    #[must_use]
    pub fn of(images: &[DepthImage], volume: &Aabb) -> Self {
        let cameras = (0..).zip(images).filter_map(|(bit, image)| match image.camera {
            Camera::Pinhole(_) => None,
            Camera::SinglePole(pole) => Some((SampleCamera::of(image, 1 << bit, false), pole)),
        });
        Self { cameras: cameras.collect(), volume: searched_volume(volume, images) }
    }

    /// The end of a ray with a direction of unit length, from `near_m` on.
    #[must_use]
    pub fn curved_search(&self, ray: &Ray, near_m: f32, search: CurvedSearch) -> RayEnd {
        self.end(ray, near_m, |seen| walk(seen, search))
    }

    /// The same, in steps of an eighth of a texel along the curve.
    #[must_use]
    pub fn every_eighth_texel(&self, ray: &Ray, near_m: f32) -> RayEnd {
        self.end(ray, near_m, exhaustive)
    }

    /// The nearest end that any image shows.
    fn end(&self, ray: &Ray, near_m: f32, walk: impl Fn(&Seen<'_>) -> Walk) -> RayEnd {
        let span = span_in(&self.volume, ray.origin_in_world, ray.direction_in_world, near_m);
        let mut end = RayEnd { kind: ProvenanceKind::Filled, way_m: FAR_AWAY, color_linear: Vec3::ZERO, steps: 0 };
        for (camera, pole) in &self.cameras {
            let Some(seen) = Seen::of(camera, pole, ray, [span[0], span[1].min(end.way_m)]) else { continue };
            let walked = walk(&seen);
            end.steps += walked.steps;
            if walked.met {
                let way_m = seen.way_m(walked.s);
                let color_linear = seen.color(walked.s);
                end = RayEnd { kind: ProvenanceKind::Hit, way_m, color_linear, ..end };
            }
        }
        if span[0] >= span[1] {
            end.kind = ProvenanceKind::Empty;
        }
        end
    }
}

/// A ray in an image, as far as it lies within the depths that the camera sees: columns and rows before they move, and inverse
/// depth, are linear in s.
struct Seen<'c> {
    camera: &'c SampleCamera,
    pole: &'c SinglePoleCamera,
    origin: Vec3,
    line: Vec3,
    span: [f32; 2],
    depths_m: [f32; 2],
}

/// The image at a place of a line: see the shader.
#[derive(Clone, Copy)]
struct Look {
    place: Vec2,
    gap: f32,
    footprint: f32,
    connected: bool,
}

struct Walk {
    s: f32,
    met: bool,
    steps: u32,
}

impl<'c> Seen<'c> {
    fn of(camera: &'c SampleCamera, pole: &'c SinglePoleCamera, ray: &Ray, span: [f32; 2]) -> Option<Self> {
        let a = camera.homogeneous(ray.origin_in_world.extend(1.0));
        let b = camera.homogeneous(ray.direction_in_world.extend(0.0));
        let size_px = camera.cells + 1.0;
        let borders = [
            [a.z - pole.reference.near_m, b.z],
            [pole.farthest_m - a.z, -b.z],
            [a.x, b.x],
            [a.y, b.y],
            [size_px.x * a.z - a.x, size_px.x * b.z - b.x],
            [size_px.y * a.z - a.y, size_px.y * b.z - b.y],
        ];
        let [near, far] = borders.into_iter().fold(span, cut);
        let [p, q] = [a + b * near, a + b * far.max(near)];
        let origin = p.xy().extend(1.0) / p.z.max(1e-20);
        let line = q.xy().extend(1.0) / q.z.max(1e-20) - origin;
        (near < far).then_some(Self { camera, pole, origin, line, span: [near, far], depths_m: [p.z, q.z] })
    }

    /// In pixels from the middle of the first.
    fn place(&self, s: f32) -> Vec2 {
        let at = self.origin + self.line * s;
        let from_pole = at.xy() - self.pole.pole_px;
        let away = from_pole * from_pole.length_squared().max(1e-12).sqrt().recip();
        at.xy() + away * (self.pole.bend_px_m() * (self.pole.reference.near_m.recip() - at.z)) - 0.5
    }

    fn look(&self, s: f32) -> Look {
        let inverse_depth = (self.origin + self.line * s).z;
        let place = self.place(s);
        let inside = place.cmpge(Vec2::ZERO).all() && place.cmplt(self.camera.cells).all();
        let clamped = place.max(Vec2::ZERO).min(self.camera.cells - CELL_MARGIN_PX);
        let corners = self.camera.corners(clamped.as_uvec2());
        let within = clamped - clamped.floor();
        let nearest = usize::from(within.x >= 0.5) + 2 * usize::from(within.y >= 0.5);
        let surface = if corners.connected { bilinear(corners.codes, within) } else { corners.codes[nearest] };
        let gap = HALF_CODE + self.camera.code(inverse_depth) - surface;
        let is_surface = inside && surface >= FIRST_SAMPLE;
        Look {
            gap: if is_surface { gap } else { FAR_AWAY },
            footprint: self.camera.code_above(inverse_depth) / self.camera.focal_px,
            connected: inside && corners.connected,
            place,
        }
    }

    /// The ray's own parameter: 1/w is linear in s.
    fn way_m(&self, s: f32) -> f32 {
        let [near_m, far_m] = self.depths_m;
        let share = s * near_m / ((1.0 - s) * far_m + s * near_m);
        self.span[0] + (self.span[1] - self.span[0]) * share
    }

    fn color(&self, s: f32) -> Vec3 {
        let clamped = self.place(s).max(Vec2::ZERO).min(self.camera.cells - CELL_MARGIN_PX);
        let cell = clamped.as_uvec2();
        let within = clamped - clamped.floor();
        let at = if self.camera.corners(cell).connected { within } else { within.round() };
        let corners = CORNERS.map(|corner| (cell + corner).min(self.camera.cells.as_uvec2()));
        let shared = corners.into_iter().zip(bilinear_shares(at));
        shared.map(|(texel, share)| self.camera.color_linear(texel) * share).sum()
    }
}

/// The part of a span in which `start + by · t` is not negative.
fn cut([near, far]: [f32; 2], [start, by]: [f32; 2]) -> [f32; 2] {
    let t = -start * safe_reciprocal(by);
    if by > 0.0 { [near.max(t), far] } else { [near, far.min(t)] }
}

fn may_meet(a: Look, b: Look, coarse_px: f32) -> bool {
    let fuzzy = 0.5 * coarse_px * a.footprint.max(b.footprint);
    a.gap.min(b.gap) <= fuzzy && a.gap.max(b.gap) >= -fuzzy
}

fn meets(a: Look, b: Look, fine_px: f32) -> bool {
    let is_close = b.gap >= -THICKNESS_FOOTPRINTS * b.footprint;
    let goes_on = a.connected && b.connected && a.place.distance(b.place) <= LONGEST_STEP * fine_px;
    a.gap > 0.0 && b.gap <= 0.0 && (is_close || goes_on)
}

fn crossing(here: Look, next: Look, s: f32, next_s: f32) -> f32 {
    s + (next_s - s) * (here.gap / (here.gap - next.gap).max(1e-9)).clamp(0.0, 1.0)
}

fn walk(seen: &Seen<'_>, CurvedSearch { coarse_px, fine_px }: CurvedSearch) -> Walk {
    let mut here = seen.look(0.0);
    let chord_px = seen.place(0.0).distance(seen.place(1.0)).max(seen.line.xy().length());
    let coarse_step = (coarse_px / chord_px.max(1e-3)).min(1.0);
    let fine_steps = (coarse_px / fine_px).ceil() as u32;
    let fine_step = coarse_step / fine_steps as f32;
    let fine_px = coarse_px / fine_steps as f32;
    let mut walk = Walk { s: 0.0, met: false, steps: 1 };
    let mut to_go = 0;
    while walk.s < 1.0 && walk.steps <= MAX_WALK_STEPS {
        let is_coarse = to_go == 0;
        let next_s = (walk.s + if is_coarse { coarse_step } else { fine_step }).min(1.0);
        let next = seen.look(next_s);
        walk.steps += 1;
        if is_coarse && fine_steps > 1 && may_meet(here, next, coarse_px) {
            to_go = fine_steps;
            continue;
        }
        to_go = u32::max(to_go, 1) - 1;
        walk.met = (!is_coarse || fine_steps == 1) && meets(here, next, fine_px);
        if walk.met {
            walk.s = crossing(here, next, walk.s, next_s);
            break;
        }
        walk.s = next_s;
        here = next;
    }
    walk
}

fn exhaustive(seen: &Seen<'_>) -> Walk {
    let mut here = seen.look(0.0);
    let mut walk = Walk { s: 0.0, met: false, steps: 1 };
    let mut step = 1.0f32;
    while walk.s < 1.0 {
        let place = seen.place(walk.s);
        step = (2.0 * step).min(1.0 - walk.s);
        while step > 1e-6 && seen.place(walk.s + step).distance(place) > EIGHTH_PX {
            step *= 0.5;
        }
        let next_s = if walk.s + step > 1.0 - 1e-6 { 1.0 } else { walk.s + step };
        let next = seen.look(next_s);
        walk.steps += 1;
        walk.met = meets(here, next, EIGHTH_PX);
        if walk.met {
            walk.s = crossing(here, next, walk.s, next_s);
            break;
        }
        (walk.s, here) = (next_s, next);
    }
    walk
}
