//! Where views stand between sample cameras. A client has only the cameras: the view cell follows from them.

use depth_image::PinholeCamera;
use glam::{Mat3, Quat, UVec2, Vec2, Vec3};

/// A rectangle of viewpoints and what all of them look at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewCell {
    center_in_world: Vec3,
    /// From the middle to the right and upper edges.
    half_edges_in_world: [Vec3; 2],
    aim: Aim,
    /// Focal length in image heights.
    focal_heights: f32,
    near_m: f32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Aim {
    /// All look at one point.
    Target(Vec3),
    /// All look the same way.
    Parallel(Quat),
}

/// The farthest that cameras may be from looking at one point, as a share of its distance.
const CONVERGENCE: f32 = 0.02;

impl ViewCell {
    /// The cell between sample cameras; `None` without any. For a rig of four corners it is their rectangle.
    #[must_use]
    pub fn between(cameras: &[PinholeCamera]) -> Option<Self> {
        let first = cameras.first()?;
        let n = cameras.len() as f32;
        let center = cameras.iter().map(|c| c.eye_in_world).sum::<Vec3>() / n;
        let turn = mean_turn(cameras);
        let reach = |axis: Vec3| cameras.iter().map(|c| (c.eye_in_world - center).dot(axis).abs()).fold(0.0, f32::max);
        let edges = corners(cameras).unwrap_or_else(|| [Vec3::X, Vec3::Y].map(|axis| turn * axis * reach(turn * axis)));
        Some(Self {
            center_in_world: center,
            half_edges_in_world: edges,
            aim: common_target(cameras).map_or(Aim::Parallel(turn), Aim::Target),
            focal_heights: first.focal_px.y / first.size_px.y as f32,
            near_m: first.near_m,
        })
    }

    /// The camera at a place of the rectangle, -1 to 1 each way.
    #[must_use]
    pub fn camera_at(&self, place: Vec2, size_px: UVec2) -> PinholeCamera {
        let eye = self.center_in_world + self.half_edges_in_world[0] * place.x + self.half_edges_in_world[1] * place.y;
        let fov_y_rad = 2.0 * (0.5 / self.focal_heights).atan();
        let target = match self.aim {
            Aim::Target(target) => target,
            Aim::Parallel(turn) => eye + turn * Vec3::NEG_Z,
        };
        let up = match self.aim {
            Aim::Target(_) => self.half_edges_in_world[1],
            Aim::Parallel(turn) => turn * Vec3::Y,
        };
        PinholeCamera { near_m: self.near_m, ..PinholeCamera::looking_at(eye, target, up, fov_y_rad, size_px) }
    }

    /// `count` views spread evenly, by a low-discrepancy sequence (R2, Roberts 2018).
    #[must_use]
    pub fn spread(&self, count: usize, size_px: UVec2) -> Vec<PinholeCamera> {
        const STEP: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);
        let place = |i: usize| (Vec2::splat(0.5) + STEP * i as f32).fract() * 2.0 - 1.0;
        (0..count).map(|i| self.camera_at(place(i), size_px)).collect()
    }

    /// `columns` × `rows` views over the whole rectangle, row by row from the bottom.
    #[must_use]
    pub fn grid(&self, columns: u32, rows: u32, size_px: UVec2) -> Vec<PinholeCamera> {
        let step = |i: u32, n: u32| if n < 2 { 0.0 } else { 2.0 * i as f32 / (n - 1) as f32 - 1.0 };
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| Vec2::new(step(x, columns), step(y, rows))));
        places.map(|place| self.camera_at(place, size_px)).collect()
    }

    /// `count` views on an ellipse inside the rectangle.
    #[must_use]
    pub fn orbit(&self, count: usize, size_px: UVec2) -> Vec<PinholeCamera> {
        let place = |i: usize| Vec2::from_angle(std::f32::consts::TAU * i as f32 / count as f32) * 0.8;
        (0..count).map(|i| self.camera_at(place(i), size_px)).collect()
    }
}

/// Of four cameras in rows from the bottom left, as rigs list them.
fn corners(cameras: &[PinholeCamera]) -> Option<[Vec3; 2]> {
    let [a, b, c, d] =
        <[&PinholeCamera; 4]>::try_from(cameras.iter().collect::<Vec<_>>()).ok()?.map(|c| c.eye_in_world);
    let (right, up) = ((b - a) * 0.5, (c - a) * 0.5);
    let is_parallelogram = (a + d - b - c).length() <= 1e-3 * (right.length() + up.length());
    let is_area = right.cross(up).length() > 1e-3 * right.length() * up.length();
    (is_parallelogram && is_area).then_some([right, up])
}

fn mean_turn(cameras: &[PinholeCamera]) -> Quat {
    let first = cameras[0].world_from_camera;
    let sum = cameras.iter().fold(Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, c| {
        let turn = c.world_from_camera;
        sum + if turn.dot(first) < 0.0 { -turn } else { turn }
    });
    if sum.length() > 1e-3 { sum.normalize() } else { first }
}

/// The point nearest to all forward axes, by least squares; `None` where they run in parallel, part, or miss it.
fn common_target(cameras: &[PinholeCamera]) -> Option<Vec3> {
    let mut matrix = Mat3::ZERO;
    let mut right_side = Vec3::ZERO;
    for camera in cameras {
        let forward = camera.forward_in_world();
        let across = Mat3::IDENTITY - Mat3::from_cols(forward * forward.x, forward * forward.y, forward * forward.z);
        matrix += across;
        right_side += across * camera.eye_in_world;
    }
    let is_parallel = matrix.determinant() < 1e-4 * (cameras.len() as f32).powi(3);
    let target = (!is_parallel).then(|| matrix.inverse() * right_side)?;
    let looks_at_it = |camera: &PinholeCamera| {
        let to_target = target - camera.eye_in_world;
        let off = to_target.cross(camera.forward_in_world()).length();
        to_target.dot(camera.forward_in_world()) > 0.0 && off <= CONVERGENCE * to_target.length()
    };
    cameras.iter().all(looks_at_it).then_some(target)
}

#[cfg(test)]
mod tests {
    use depth_image::Aabb;
    use sampling::Rig;

    use super::*;

    const SIZE: UVec2 = UVec2::new(40, 30);

    #[test]
    fn a_rig_is_found_again_from_its_cameras() {
        let block = Aabb { min: Vec3::new(-1.0, 0.0, -2.0), max: Vec3::new(1.0, 1.0, 2.0) };
        for rig in [Rig::two_plane(&block, 3.0), Rig::in_front_of(&block, 0.12)] {
            let rig = rig.expect("a block");
            let cell = ViewCell::between(&rig.samples(UVec2::new(400, 300))).expect("four cameras");
            let pairs = rig.views(20, SIZE).into_iter().zip(cell.spread(20, SIZE));
            for (expected, found) in pairs {
                assert!((expected.eye_in_world - found.eye_in_world).length() < 1e-4);
                assert!(expected.forward_in_world().dot(found.forward_in_world()) > 1.0 - 1e-5);
                assert!((expected.focal_px - found.focal_px).length() < 1e-2);
            }
        }
    }

    #[test]
    fn parallel_cameras_stay_parallel() {
        let camera = |x: f32, y: f32| {
            let eye = Vec3::new(x, y, 2.2);
            PinholeCamera::looking_at(eye, eye - Vec3::Z, Vec3::Y, 0.8, SIZE)
        };
        let cell = ViewCell::between(&[camera(-0.1, 0.1), camera(0.1, 0.1), camera(-0.1, 0.4), camera(0.1, 0.4)])
            .expect("four");
        for view in cell.grid(3, 3, SIZE) {
            assert!(view.forward_in_world().dot(Vec3::NEG_Z) > 1.0 - 1e-6);
        }
        assert!((cell.grid(3, 3, SIZE)[0].eye_in_world - Vec3::new(-0.1, 0.1, 2.2)).length() < 1e-6);
    }

    #[test]
    fn one_camera_is_a_cell_of_one_point_and_none_is_none() {
        let one = PinholeCamera::looking_at(Vec3::ONE, Vec3::ZERO, Vec3::Y, 0.8, SIZE);
        let cell = ViewCell::between(&[one]).expect("one");
        assert_eq!(cell.orbit(5, SIZE)[3].eye_in_world, Vec3::ONE);
        assert_eq!(ViewCell::between(&[]), None);
    }
}
