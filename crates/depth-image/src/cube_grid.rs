//! The grid of a layered depth cube: lines along three orthogonal axes, all of one spacing.

use glam::{Mat3A, Quat, UVec2, UVec3, Vec2, Vec3};

use crate::projection::{check_finite, check_range, check_unit};
use crate::{Aabb, CameraError, ParallelCamera, PixelDepth};

/// A box of cubic cells. Through the middle of each row of cells, along each of the three axes, runs a line on which a scene is
/// sampled (Lischinski §3.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubeGrid {
    /// The corner of the first cell.
    pub corner_in_world: Vec3,
    /// A unit quaternion.
    pub world_from_cube: Quat,
    /// The side of a cell, metres.
    pub spacing_m: f32,
    /// Cells along each axis.
    pub size: UVec3,
}

/// The sides that a cube may have, in cells.
pub const CUBE_SIDES: std::ops::RangeInclusive<u32> = 16..=4096;

/// How far the lines of a grid's camera may be from the grid's, in spacings: coordinates are rounded.
const CAMERA_ROUNDING: f32 = 0.05;

impl CubeGrid {
    /// The grid around a box with `side` cells along its longest edge, and 16 at least along the others. Surfaces on the faces of the
    /// box lie within it.
    ///
    /// # Errors
    /// A side beyond [`CUBE_SIDES`], and a box that is empty or not finite.
    pub fn around(bounds: &Aabb, side: u32) -> Result<Self, CameraError> {
        check_range("side", side, CUBE_SIDES.contains(&side), "from 16 to 4096")?;
        let extent_m = bounds.size().max_element();
        let is_finite = bounds.min.is_finite() && bounds.max.is_finite() && extent_m.is_finite();
        check_finite("bounds", is_finite && extent_m > 0.0)?;
        let spacing_m = extent_m / (side - 1) as f32;
        // Half a cell of room on each side, and for the rounding of coordinates.
        let size = (bounds.size() / spacing_m + 1.0 - 1e-3).ceil().as_uvec3();
        let size = size.clamp(UVec3::splat(*CUBE_SIDES.start()), UVec3::splat(side));
        let corner_in_world = bounds.center() - size.as_vec3() * (0.5 * spacing_m);
        Ok(Self { corner_in_world, world_from_cube: Quat::IDENTITY, spacing_m, size })
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is not finite or out of range.
    pub fn validate(&self) -> Result<(), CameraError> {
        let side = self.size.max_element();
        check_finite(
            "corner_in_world or world_from_cube",
            self.corner_in_world.is_finite() && self.world_from_cube.length().is_finite(),
        )?;
        check_unit("world_from_cube", self.world_from_cube)?;
        check_range("size", side, side <= *CUBE_SIDES.end(), "at most 4096")?;
        (0..3).try_for_each(|axis| self.camera(axis).validate())
    }

    /// The grid whose cameras these are, one along each axis in their order; `None` of others.
    #[must_use]
    pub fn of_cameras(cameras: &[ParallelCamera]) -> Option<Self> {
        let &[first, second, _] = cameras else { return None };
        let frame = Mat3A::from_quat(first.world_from_camera);
        let axes = Mat3A::from_cols(frame.z_axis, frame.x_axis, frame.y_axis);
        let [own, rows] = [second.size_px.y, first.size_px.y];
        let grid = Self {
            corner_in_world: first.corner_in_world
                - Vec3::from(frame.y_axis) * (rows as f32 * first.spacing_m)
                - Vec3::from(frame.z_axis) * (own as f32 * first.spacing_m),
            world_from_cube: Quat::from_mat3a(&axes).normalize(),
            spacing_m: first.spacing_m,
            size: UVec3::new(own, first.size_px.x, rows),
        };
        let has_all =
            grid.validate().is_ok() && cameras.iter().enumerate().all(|(axis, camera)| grid.has_camera(axis, camera));
        has_all.then_some(grid)
    }

    /// Whether a camera has the lines along an axis, but for rounding.
    #[must_use]
    pub fn has_camera(&self, axis: usize, camera: &ParallelCamera) -> bool {
        let own = self.camera(axis);
        let [right, end] = [Vec2::new(own.size_px.x as f32, 0.0), own.size_px.as_vec2()];
        let places = [(Vec2::ZERO, 0.0), (right, 0.0), (end, 0.0), (Vec2::ZERO, own.range_m)];
        let is_alike =
            own.size_px == camera.size_px && (own.range_m - camera.range_m).abs() < CAMERA_ROUNDING * own.spacing_m;
        is_alike
            && places.into_iter().all(|(pixel, planar_depth_m)| {
                let at = PixelDepth { pixel, planar_depth_m };
                own.unproject(at).distance(camera.unproject(at)) < CAMERA_ROUNDING * self.spacing_m
            })
    }

    /// The cameras along the three axes.
    #[must_use]
    pub fn cameras(&self) -> [ParallelCamera; 3] {
        [0, 1, 2].map(|axis| self.camera(axis))
    }

    /// The camera of the lines along an axis, 0 to 2, which looks against the axis. Its columns rise along the next axis, and
    /// its rows fall along the one after that.
    #[must_use]
    pub fn camera(&self, axis: usize) -> ParallelCamera {
        let axes = Mat3A::from_quat(self.world_from_cube);
        let [own, columns, rows] = [0, 1, 2].map(|offset| (axis + offset) % 3);
        let frame = Mat3A::from_cols(axes.col(columns), axes.col(rows), axes.col(own));
        let edges_m = self.size.as_vec3() * self.spacing_m;
        ParallelCamera {
            corner_in_world: self.corner_in_world
                + Vec3::from(axes.col(rows)) * edges_m[rows]
                + Vec3::from(axes.col(own)) * edges_m[own],
            world_from_camera: Quat::from_mat3a(&frame).normalize(),
            spacing_m: self.spacing_m,
            size_px: UVec2::new(self.size[columns], self.size[rows]),
            range_m: edges_m[own],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_see_each_other_s_points_in_one_grid() {
        let turned = Quat::from_rotation_y(0.4) * Quat::from_rotation_x(0.2);
        let grid = CubeGrid { world_from_cube: turned, ..CubeGrid::around(&bounds(), 32).unwrap() };
        let place = Vec3::new(3.25, 7.5, 2.75);
        let point_in_world = grid.corner_in_world + turned * (place * grid.spacing_m);
        for axis in 0..3 {
            let PixelDepth { pixel, planar_depth_m } = grid.camera(axis).project(point_in_world).unwrap();
            let [columns, rows] = [(axis + 1) % 3, (axis + 2) % 3];
            let depth = grid.size[axis] as f32 - planar_depth_m / grid.spacing_m;
            assert!((depth - place[axis]).abs() < 1e-3, "{axis}: {depth}");
            assert!((pixel.x - place[columns]).abs() < 1e-3, "{axis}: {pixel}");
            assert!((grid.size[rows] as f32 - pixel.y - place[rows]).abs() < 1e-3, "{axis}: {pixel}");
        }
    }

    #[test]
    fn a_grid_is_known_by_its_three_cameras_alone() {
        let turned = Quat::from_rotation_y(0.4) * Quat::from_rotation_x(0.2);
        for world_from_cube in [Quat::IDENTITY, turned] {
            let grid = CubeGrid { world_from_cube, ..CubeGrid::around(&bounds(), 512).unwrap() };
            let cameras = [0, 1, 2].map(|axis| grid.camera(axis));
            let known = CubeGrid::of_cameras(&cameras).unwrap();
            assert_eq!((known.size, known.spacing_m), (grid.size, grid.spacing_m));
            assert!((0..3).all(|axis| known.has_camera(axis, &cameras[axis])));
            let [x, y, z] = cameras;
            assert_eq!(CubeGrid::of_cameras(&[x, z, y]), None);
            assert_eq!(CubeGrid::of_cameras(&[x, y]), None);
            let moved = ParallelCamera { corner_in_world: z.corner_in_world + Vec3::X * (0.1 * z.spacing_m), ..z };
            let shorter = ParallelCamera { range_m: 0.9 * z.range_m, ..z };
            let twisted = ParallelCamera { world_from_camera: z.world_from_camera * Quat::from_rotation_z(1e-3), ..z };
            for other in [moved, shorter, twisted, ParallelCamera { corner_in_world: Vec3::NAN, ..z }] {
                assert_eq!(CubeGrid::of_cameras(&[x, y, other]), None);
            }
        }
    }

    #[test]
    fn faces_of_the_box_lie_within_the_grid_and_its_longest_edge_has_the_asked_cells() {
        let bounds = bounds();
        for side in [16, 100, 512] {
            let grid = CubeGrid::around(&bounds, side).unwrap();
            assert_eq!(grid.size.max_element(), side);
            let camera = grid.camera(1);
            let seen = |point| camera.project(point).is_some_and(|at| at.pixel.cmpge(Vec2::splat(0.4)).all());
            assert!(bounds.corners().into_iter().all(seen), "{side}");
            assert_eq!(grid.validate(), Ok(()));
        }
    }

    #[test]
    fn impossible_grids_are_refused_by_name() {
        assert!(matches!(CubeGrid::around(&bounds(), 15), Err(CameraError::OutOfRange { field: "side", .. })));
        assert!(matches!(CubeGrid::around(&bounds(), 4097), Err(CameraError::OutOfRange { field: "side", .. })));
        assert!(matches!(CubeGrid::around(&Aabb::EMPTY, 64), Err(CameraError::NotFinite { field: "bounds" })));
        let point = Aabb { min: Vec3::ONE, max: Vec3::ONE };
        assert!(matches!(CubeGrid::around(&point, 64), Err(CameraError::NotFinite { field: "bounds" })));
        let endless = Aabb { min: Vec3::splat(-3e38), max: Vec3::splat(3e38) };
        assert!(matches!(CubeGrid::around(&endless, 64), Err(CameraError::NotFinite { field: "bounds" })));
        let good = CubeGrid::around(&bounds(), 64).unwrap();
        let stretched = CubeGrid { world_from_cube: Quat::from_xyzw(0.0, 0.0, 0.0, 2.0), ..good };
        assert!(matches!(stretched.validate(), Err(CameraError::OutOfRange { field: "world_from_cube", .. })));
        let large = CubeGrid { size: UVec3::new(64, 5000, 64), ..good };
        assert!(matches!(large.validate(), Err(CameraError::OutOfRange { field: "size", .. })));
    }

    fn bounds() -> Aabb {
        Aabb { min: Vec3::new(-4.0, 0.0, -3.0), max: Vec3::new(6.0, 3.0, 2.5) }
    }
}
