//! Places of sample cameras.

use depth_image::{Aabb, PinholeCamera};
use glam::{UVec2, Vec2, Vec3};

/// Four cameras at the corners of a rectangle, all looking at one point: the two-plane rig of Lages
/// §4.1. The rectangle is the view cell; views lie within it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rig {
    /// The rectangle's middle.
    pub center_in_world: Vec3,
    /// From the middle to the right and upper edges.
    pub half_edges_in_world: [Vec3; 2],
    /// The point that all cameras look at.
    pub target_in_world: Vec3,
    /// Full vertical field of view.
    pub fov_y_rad: f32,
    /// Surfaces closer than this are not drawn.
    pub near_m: f32,
}

/// Why a rig cannot be placed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the volume to sample is empty or not finite")]
pub struct RigError;

/// 45 degrees, as in the paper.
const FOV_Y_RAD: f32 = std::f32::consts::FRAC_PI_4;

impl Rig {
    /// The rig of the paper: cameras above the corners of a block between two horizontal planes, looking at the
    /// middle of the tile. `height` is in halves of the block's width (the paper leaves it open).
    ///
    /// # Errors
    /// When the block is empty.
    pub fn two_plane(block: &Aabb, height: f32) -> Result<Self, RigError> {
        check(block)?;
        let half = block.size() * 0.5;
        let center = block.center();
        let above = Vec3::new(center.x, block.min.y + height * half.x.max(half.z), center.z);
        Ok(Self {
            center_in_world: above,
            half_edges_in_world: [Vec3::X * half.x, Vec3::NEG_Z * half.z],
            target_in_world: Vec3::new(center.x, block.min.y, center.z),
            fov_y_rad: FOV_Y_RAD,
            near_m: half.max_element() * 0.05,
        })
    }

    /// Before a model's front, at a distance from which all of it is seen, slightly raised. Neighbouring
    /// cameras see its middle 2 · `spread_rad` apart.
    ///
    /// # Errors
    /// When the volume is empty.
    pub fn in_front_of(volume: &Aabb, spread_rad: f32) -> Result<Self, RigError> {
        check(volume)?;
        let radius_m = volume.size().length() * 0.5;
        // The whole sphere fits at the corner cameras too, which are a little farther away.
        let distance_m = radius_m / (FOV_Y_RAD * 0.5).sin();
        let backwards = Vec3::new(0.35, 0.3, 1.0).normalize_or(Vec3::Z);
        let right = Vec3::Y.cross(backwards).normalize_or(Vec3::X);
        let half = distance_m * spread_rad.tan();
        Ok(Self {
            center_in_world: volume.center() + backwards * distance_m,
            half_edges_in_world: [right * half, backwards.cross(right) * half],
            target_in_world: volume.center(),
            fov_y_rad: FOV_Y_RAD,
            near_m: (distance_m - radius_m) * 0.25,
        })
    }

    /// The camera at a place of the rectangle, -1 to 1 each way.
    #[must_use]
    pub fn camera_at(&self, place: Vec2, size_px: UVec2) -> PinholeCamera {
        let eye = self.center_in_world + self.half_edges_in_world[0] * place.x + self.half_edges_in_world[1] * place.y;
        let up = self.half_edges_in_world[1];
        PinholeCamera {
            near_m: self.near_m,
            ..PinholeCamera::looking_at(eye, self.target_in_world, up, self.fov_y_rad, size_px)
        }
    }

    /// The four sample cameras.
    #[must_use]
    pub fn samples(&self, size_px: UVec2) -> Vec<PinholeCamera> {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
        corners.map(|(x, y)| self.camera_at(Vec2::new(x, y), size_px)).to_vec()
    }
}

fn check(volume: &Aabb) -> Result<(), RigError> {
    let usable = !volume.is_empty() && volume.size().is_finite() && volume.size().max_element() > 0.0;
    usable.then_some(()).ok_or(RigError)
}

#[cfg(test)]
mod tests {
    use depth_image::ViewCell;

    use super::*;

    const BLOCK: Aabb = Aabb { min: Vec3::new(-1.0, 0.0, -1.0), max: Vec3::new(1.0, 1.0, 1.0) };

    #[test]
    fn four_cameras_above_the_corners_see_the_middle_in_the_middle() {
        let rig = Rig::two_plane(&BLOCK, 3.0).expect("a block");
        let cameras = rig.samples(UVec2::new(400, 300));
        assert_eq!(cameras.len(), 4);
        for camera in cameras {
            camera.validate().expect("valid");
            assert!((camera.eye_in_world.abs() - Vec3::new(1.0, 3.0, 1.0)).length() < 1e-6);
            let at = camera.project(Vec3::ZERO).expect("in front");
            assert!((at.pixel - Vec2::new(200.0, 150.0)).length() < 1e-2);
        }
    }

    #[test]
    fn a_rig_is_found_again_from_its_cameras() {
        let (block, size_px) =
            (Aabb { min: Vec3::new(-1.0, 0.0, -2.0), max: Vec3::new(1.0, 1.0, 2.0) }, UVec2::new(40, 30));
        for rig in [Rig::two_plane(&block, 3.0), Rig::in_front_of(&block, 0.12)] {
            let rig = rig.expect("a block");
            let cell = ViewCell::between(&rig.samples(UVec2::new(400, 300))).expect("four cameras");
            for place in [Vec2::ZERO, Vec2::new(-1.0, 1.0), Vec2::new(0.3, -0.8)] {
                let [expected, found] = [rig.camera_at(place, size_px), cell.camera_at(place, size_px)];
                assert!((expected.eye_in_world - found.eye_in_world).length() < 1e-4);
                assert!(expected.forward_in_world().dot(found.forward_in_world()) > 1.0 - 1e-5);
                assert!((expected.focal_px - found.focal_px).length() < 1e-2);
            }
        }
    }

    #[test]
    fn views_stay_in_the_cell() {
        let rig = Rig::two_plane(&BLOCK, 3.0).expect("a block");
        let cell = ViewCell::between(&rig.samples(UVec2::new(400, 300))).expect("four cameras");
        let views =
            [cell.spread(290, UVec2::new(200, 150)), cell.grid(5, 4, UVec2::ONE), cell.orbit(24, UVec2::ONE)].concat();
        assert_eq!(views.len(), 290 + 20 + 24);
        assert!(views.iter().all(|v| v.eye_in_world.xz().abs().max_element() <= 1.0 + 1e-5));
    }

    #[test]
    fn a_model_is_seen_whole() {
        let rig = Rig::in_front_of(&BLOCK, 0.15).expect("a block");
        for camera in rig.samples(UVec2::new(400, 300)) {
            for corner in BLOCK.corners() {
                let at = camera.project(corner).expect("in front");
                assert!(camera.contains(at.pixel) && at.planar_depth_m > camera.near_m, "{at:?}");
            }
        }
    }

    #[test]
    fn an_empty_volume_is_an_error() {
        assert_eq!(Rig::two_plane(&Aabb::EMPTY, 3.0), Err(RigError));
        assert_eq!(Rig::in_front_of(&Aabb { min: Vec3::NAN, max: Vec3::NAN }, 0.1), Err(RigError));
    }

    use glam::Vec3Swizzles;
}
