//! Corridors in closed form: rooms whose walls are the ends of rays.

use depth_image::Ray;
use glam::{DVec3, UVec2, Vec3};

use super::camera::{GraphCamera, GraphPlan, Layout};
use super::image::Met;
use super::through::{Corridor, through, upright};

const HALF_M: f64 = 0.45;
const HEIGHT_M: f64 = 1.0;
/// Between the middles of two junctions.
const LENGTH_M: f64 = 2.0;
const EYE_DISTANCE_M: f64 = 1.5;
/// A ray goes on in the next room from this far behind a border.
const STEP_M: f64 = 1e-7;

/// Corridors that turn to the right and to the left by turns.
pub struct Zigzag {
    rooms: Vec<[DVec3; 2]>,
    pub plan: GraphPlan,
}

impl Zigzag {
    pub fn new(corridors: usize, size_px: UVec2) -> Self {
        let headings = [DVec3::NEG_Z, DVec3::X];
        let mut rooms = Vec::new();
        let mut portals = Vec::new();
        let mut start = DVec3::ZERO;
        for number in 0..corridors {
            let heading = headings[number % 2];
            let aside = DVec3::new(heading.z.abs(), 0.0, heading.x.abs()) * HALF_M;
            let end = start + heading * LENGTH_M;
            let face = if number == 0 {
                [start - aside - heading * HALF_M, start + aside - heading * HALF_M]
            } else {
                let before = headings[(number + 1) % 2];
                [start + (heading - before) * HALF_M, start + (before - heading) * HALF_M]
            };
            let [a, b] = [start - aside - heading * HALF_M, end + aside + heading * HALF_M];
            rooms.push([a.min(b), a.max(b) + DVec3::Y * HEIGHT_M]);
            let axis = [start, end + heading * HALF_M];
            let corridor = Corridor { axis, half_width_m: HALF_M, height_m: HEIGHT_M };
            portals.push(corridor.portal(number.checked_sub(1), upright(face, HEIGHT_M), EYE_DISTANCE_M));
            start = end;
        }
        Self { rooms, plan: through(&portals, size_px).unwrap() }
    }

    pub fn camera(&self, layout: &Layout) -> GraphCamera {
        GraphCamera::new(&self.plan, layout).unwrap()
    }

    /// The wall at which a ray leaves the rooms.
    pub fn meet(&self, ray: &Ray, [near, far]: [f32; 2]) -> Option<Met> {
        let origin = ray.origin_in_world.as_dvec3();
        let direction = ray.direction_in_world.as_dvec3();
        let step = STEP_M / direction.length();
        let mut t = f64::from(near) + step;
        let mut left = None;
        while let Some(room) = self.rooms.iter().find(|room| is_in(room, origin + direction * t)) {
            let (exit, axis) = exit(room, origin, direction);
            left = Some((exit, axis));
            t = exit + step;
        }
        let (t, axis) = left.filter(|(t, _)| *t <= f64::from(far))?;
        let normal_in_world = -(DVec3::AXES[axis] * direction[axis].signum()).as_vec3();
        Some(Met { t: t as f32, normal_in_world, color_linear: Vec3::splat(0.25 * (axis + 1) as f32) })
    }

    /// A place within the rooms, and a direction from there.
    pub fn ray(&self, number: u32) -> Ray {
        let [min, max] = self.rooms[(number % self.rooms.len() as u32) as usize];
        let at = DVec3::new(noise(number, 1), noise(number, 2), noise(number, 3)) * 0.96 + 0.02;
        let (sin, cos) = (std::f64::consts::TAU * noise(number, 4)).sin_cos();
        let towards = DVec3::new(sin, 1.2 * noise(number, 5) - 0.6, cos).normalize_or_zero();
        Ray { origin_in_world: (min + (max - min) * at).as_vec3(), direction_in_world: towards.as_vec3() }
    }
}

fn is_in([min, max]: &[DVec3; 2], point: DVec3) -> bool {
    point.cmpge(*min).all() && point.cmple(*max).all()
}

/// Where a line leaves a box, and through the side of which axis.
fn exit([min, max]: &[DVec3; 2], origin: DVec3, direction: DVec3) -> (f64, usize) {
    let ends = [0, 1, 2].map(|axis| {
        let side = if direction[axis] > 0.0 { max[axis] } else { min[axis] };
        let t = (side - origin[axis]) / direction[axis];
        (if direction[axis] == 0.0 { f64::INFINITY } else { t }, axis)
    });
    ends.into_iter().min_by(|(a, _), (b, _)| a.total_cmp(b)).unwrap()
}

/// From 0 to 1, without order.
fn noise(number: u32, part: u32) -> f64 {
    f64::from(number * 8 + part).mul_add(0.618_033_988_7, 0.371 * f64::from(part)).fract()
}
