//! A box of viewpoints that one sample set serves.

use glam::{Mat3, Quat, UVec2, Vec2, Vec3};

use crate::PinholeCamera;

/// Greatest distance of cameras' axes from a common target, as a share of its distance.
const CONVERGENCE: f32 = 0.02;
/// Greatest half side of an image at unit distance: 150 degrees.
const STEEPEST: f32 = 3.7;
/// Smallest rotation between cameras, in radians, from which a common up vector follows.
const LEAST_TURN: f32 = 1e-2;
/// Tolerance of equal fields of view.
const ROUNDING: f32 = 1e-3;

/// Places of sample cameras on the rectangle halfway between front and rear, in a fixed nested order: corners, the middle,
/// middles of edges.
const NESTED: [Vec2; 9] = [
    Vec2::new(-1.0, -1.0),
    Vec2::new(1.0, 1.0),
    Vec2::new(1.0, -1.0),
    Vec2::new(-1.0, 1.0),
    Vec2::ZERO,
    Vec2::new(0.0, -1.0),
    Vec2::new(0.0, 1.0),
    Vec2::new(-1.0, 0.0),
    Vec2::new(1.0, 0.0),
];

/// A box of viewpoints and their common aim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewCell {
    center_in_world: Vec3,
    /// Vectors from the middle to the right, upper and rear faces.
    half_edges_in_world: [Vec3; 3],
    aim: Aim,
    up_in_world: Vec3,
    /// Focal length of the first camera, in image heights.
    focal_heights: f32,
    /// Half sides, at unit distance, of an image that contains the cameras' fields of view.
    half_sides: Vec2,
    near_m: f32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Aim {
    /// All cameras are aimed at one point.
    Target(Vec3),
    /// All cameras have one orientation.
    Parallel(Quat),
}

impl ViewCell {
    /// The cell of sample cameras or views; `None` without any. The cell of a rig of four corners is their rectangle.
    #[must_use]
    pub fn between(cameras: &[PinholeCamera]) -> Option<Self> {
        let first = cameras.first()?;
        let turn = mean_turn(cameras);
        let (center_in_world, half_edges_in_world) = corners(cameras).unwrap_or_else(|| extent(cameras, turn));
        let cell = Self {
            center_in_world,
            half_edges_in_world,
            aim: common_target(cameras).map_or(Aim::Parallel(turn), Aim::Target),
            up_in_world: common_up(cameras, turn),
            focal_heights: first.focal_px.y / first.size_px.y as f32,
            half_sides: Vec2::ZERO,
            near_m: cameras.iter().map(|camera| camera.near_m).fold(f32::INFINITY, f32::min),
        };
        let half_sides = cameras.iter().map(|camera| cell.half_sides_of(camera)).fold(Vec2::ZERO, Vec2::max);
        Some(Self { half_sides, ..cell })
    }

    /// Cameras that together see the fields of view of all views of the cell, one at each corner of the box. Edges up to
    /// `shortest_edge_m` do not count: there are 1, 2 (the ends of a line), 4 or 8 cameras.
    #[must_use]
    pub fn sample_cameras(&self, shortest_edge_m: f32, size_px: UVec2) -> Vec<PinholeCamera> {
        let focal_px = (size_px.as_vec2() * 0.5 / self.half_sides).min_element();
        let [x, y, z] = self.half_edges_in_world.map(|half| -> &[f32] {
            if 2.0 * half.length() > shortest_edge_m { &[-1.0, 1.0] } else { &[0.0] }
        });
        let rows = z.iter().flat_map(|&z| y.iter().map(move |&y| (y, z)));
        let places = rows.flat_map(|(y, z)| x.iter().map(move |&x| Vec3::new(x, y, z)));
        places.map(|place| self.camera(place, focal_px, size_px)).collect()
    }

    /// Up to nine cameras that together see the fields of view of all views of the cell, in a fixed nested order; one stands
    /// in the middle. More cameras are the same and others, so that sets of several sizes share their images.
    #[must_use]
    pub fn nested_cameras(&self, count: usize, size_px: UVec2) -> Vec<PinholeCamera> {
        let focal_px = (size_px.as_vec2() * 0.5 / self.half_sides).min_element();
        nested_places(count).iter().map(|place| self.camera(place.extend(0.0), focal_px, size_px)).collect()
    }

    /// The view from a place of the box, -1 to 1 in all directions (to the right, up and back), with the size and the lens of
    /// another.
    #[must_use]
    pub fn view_at(&self, place: Vec3, like: &PinholeCamera) -> PinholeCamera {
        let eye_in_world = self.eye_at(place);
        PinholeCamera { eye_in_world, world_from_camera: self.turn_at(eye_in_world), ..*like }
    }

    /// The cell with edges of at least this length, about the same middle. Views keep their aim.
    #[must_use]
    pub fn grown_to(&self, edge_m: f32) -> Self {
        let axes = Mat3::from_quat(self.turn_at(self.center_in_world));
        let mut grown = *self;
        for (half, axis) in grown.half_edges_in_world.iter_mut().zip([axes.x_axis, axes.y_axis, axes.z_axis]) {
            let half_m = 0.5 * edge_m;
            if half.length() < half_m {
                *half = half.try_normalize().unwrap_or(axis) * half_m;
            }
        }
        grown
    }

    /// Returns whether the sample images contain the field of view of a camera within the cell.
    pub(crate) fn sees_all_of(&self, camera: &PinholeCamera) -> bool {
        self.half_sides_of(camera).cmple(self.half_sides * (1.0 + ROUNDING)).all()
    }

    /// The camera at a place of the rectangle halfway between front and rear, -1 to 1 in both directions. Its shorter side has the field of
    /// view of the sample images' height: in portrait format a model is as whole as in landscape format.
    #[must_use]
    pub fn camera_at(&self, place: Vec2, size_px: UVec2) -> PinholeCamera {
        self.camera(place.extend(0.0), self.focal_heights * size_px.min_element() as f32, size_px)
    }

    /// `count` views spread evenly, by a low-discrepancy sequence (R2, Roberts 2018).
    #[must_use]
    pub fn spread(&self, count: usize, size_px: UVec2) -> Vec<PinholeCamera> {
        const STEP: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);
        let places = (0..count).map(|i| (Vec2::splat(0.5) + STEP * i as f32).fract() * 2.0 - 1.0);
        places.map(|place| self.camera_at(place, size_px)).collect()
    }

    /// `columns` × `rows` views over the whole rectangle, row by row from the bottom.
    #[must_use]
    pub fn grid(&self, columns: u32, rows: u32, size_px: UVec2) -> Vec<PinholeCamera> {
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| Vec2::new(step(x, columns), step(y, rows))));
        places.map(|place| self.camera_at(place, size_px)).collect()
    }

    /// `count` views on an ellipse inside the rectangle.
    #[must_use]
    pub fn orbit(&self, count: usize, size_px: UVec2) -> Vec<PinholeCamera> {
        let places = (0..count).map(|i| Vec2::from_angle(std::f32::consts::TAU * i as f32 / count as f32) * 0.8);
        places.map(|place| self.camera_at(place, size_px)).collect()
    }

    /// `count` views on a full circle around an upright axis. They have the cell's height and field of view, and are
    /// oriented like the view in its middle.
    #[must_use]
    pub fn around(&self, axis_in_world: Vec3, count: usize, size_px: UVec2) -> Vec<PinholeCamera> {
        let middle = self.camera_at(Vec2::ZERO, size_px);
        let turned = (0..count).map(|i| {
            let turn = Quat::from_rotation_y(std::f32::consts::TAU * i as f32 / count as f32);
            PinholeCamera {
                eye_in_world: axis_in_world + turn * (middle.eye_in_world - axis_in_world),
                world_from_camera: (turn * middle.world_from_camera).normalize(),
                ..middle
            }
        });
        turned.collect()
    }

    fn eye_at(&self, place: Vec3) -> Vec3 {
        let offsets = self.half_edges_in_world.iter().zip(place.to_array()).map(|(half, at)| *half * at);
        self.center_in_world + offsets.sum::<Vec3>()
    }

    fn camera(&self, place: Vec3, focal_px: f32, size_px: UVec2) -> PinholeCamera {
        let eye = self.eye_at(place);
        PinholeCamera {
            eye_in_world: eye,
            world_from_camera: self.turn_at(eye),
            focal_px: Vec2::splat(focal_px),
            principal_px: size_px.as_vec2() * 0.5,
            size_px,
            near_m: self.near_m,
        }
    }

    fn turn_at(&self, eye: Vec3) -> Quat {
        match self.aim {
            Aim::Parallel(turn) => turn,
            Aim::Target(target) => {
                PinholeCamera::looking_at(eye, target, self.up_in_world, 1.0, UVec2::ONE).world_from_camera
            }
        }
    }

    /// Half sides of an image from the same eye that contains the camera's field of view.
    fn half_sides_of(&self, camera: &PinholeCamera) -> Vec2 {
        let cell_from_camera = self.turn_at(camera.eye_in_world).conjugate() * camera.world_from_camera;
        let near = -camera.principal_px / camera.focal_px;
        let far = (camera.size_px.as_vec2() - camera.principal_px) / camera.focal_px;
        let corners = [near, far, Vec2::new(near.x, far.y), Vec2::new(far.x, near.y)];
        let slopes = corners.map(|corner| {
            let direction = cell_from_camera * Vec3::new(corner.x, -corner.y, -1.0);
            direction.truncate().abs() / (-direction.z).max(1e-6)
        });
        slopes.into_iter().fold(Vec2::ZERO, Vec2::max).min(Vec2::splat(STEEPEST))
    }
}

/// The places of up to nine sample cameras on a rectangle, -1 to 1 in both directions, in a fixed nested order; one camera
/// stands in the middle.
#[must_use]
pub fn nested_places(count: usize) -> &'static [Vec2] {
    if count == 1 { &NESTED[4..5] } else { &NESTED[..count.min(NESTED.len())] }
}

/// The place of the `i`-th of `n` views along an edge, -1 to 1.
fn step(i: u32, n: u32) -> f32 {
    if n < 2 { 0.0 } else { 2.0 * i as f32 / (n - 1) as f32 - 1.0 }
}

/// Middle and half edges of the box in the cameras' orientation.
fn extent(cameras: &[PinholeCamera], turn: Quat) -> (Vec3, [Vec3; 3]) {
    // Offsets from one camera keep precision far from the world's origin.
    let from = cameras.first().map_or(Vec3::ZERO, |camera| camera.eye_in_world);
    let eyes = cameras.iter().map(|camera| turn.conjugate() * (camera.eye_in_world - from));
    let (least, most) = eyes.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), eye| (a.min(eye), b.max(eye)));
    let half = (most - least) * 0.5;
    (from + turn * (least + half), [turn * Vec3::X * half.x, turn * Vec3::Y * half.y, turn * Vec3::Z * half.z])
}

/// Middle and half edges of four cameras in rows from the bottom left, as rigs list them.
fn corners(cameras: &[PinholeCamera]) -> Option<(Vec3, [Vec3; 3])> {
    let [a, b, c, d] = <&[PinholeCamera; 4]>::try_from(cameras).ok()?.each_ref().map(|camera| camera.eye_in_world);
    let right = (b - a) * 0.5;
    let up = (c - a) * 0.5;
    let is_parallelogram = (a + d - b - c).length() <= 1e-3 * (right.length() + up.length());
    let is_area = right.cross(up).length() > 1e-3 * right.length() * up.length();
    (is_parallelogram && is_area).then_some(((a + b + c + d) / 4.0, [right, up, Vec3::ZERO]))
}

fn mean_turn(cameras: &[PinholeCamera]) -> Quat {
    let first = cameras[0].world_from_camera;
    let sum = cameras.iter().fold(Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, camera| {
        let turn = camera.world_from_camera;
        sum + if turn.dot(first) < 0.0 { -turn } else { turn }
    });
    if sum.length() > 1e-3 { sum.normalize() } else { first }
}

/// The common up vector: perpendicular to the right axes of the first camera and the one that differs most from it.
/// Without such a camera it is that of the mean orientation.
fn common_up(cameras: &[PinholeCamera], turn: Quat) -> Vec3 {
    let rights = cameras.iter().map(|camera| camera.world_from_camera * Vec3::X);
    let first = cameras.first().map_or(Vec3::X, |camera| camera.world_from_camera * Vec3::X);
    let across = rights.map(|right| first.cross(right));
    let up = across.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())).unwrap_or(Vec3::ZERO);
    let mean = turn * Vec3::Y;
    match up.try_normalize().map(|up| up * up.dot(mean).signum()) {
        Some(up_in_world) if up.length() > LEAST_TURN && up_in_world.dot(mean) > 0.5 => up_in_world,
        _ => mean,
    }
}

/// The point nearest to all forward axes, by least squares; `None` where they are parallel, diverge or miss it.
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
    let is_aimed_at = cameras.iter().all(|camera| {
        let to_target = target - camera.eye_in_world;
        let off = to_target.cross(camera.forward_in_world()).length();
        to_target.dot(camera.forward_in_world()) > 0.0 && off <= CONVERGENCE * to_target.length()
    });
    is_aimed_at.then_some(target)
}

#[cfg(test)]
#[path = "view_cell_tests.rs"]
mod tests;
