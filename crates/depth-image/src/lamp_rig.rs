//! Cameras of a rectangle that shines, for shadow maps (Xie et al. 2016, §5; from samples since Agrawala et al. 2000).

use glam::{Mat3A, Quat, UVec2, Vec2, Vec3};

use crate::{Aabb, Light, PinholeCamera};

/// Cameras of a rectangle see no farther to a side than 80°: the tangent.
pub const MAX_LAMP_SLOPE: f32 = 5.671_282;
/// The near plane is at least this share of the scene's diagonal away, where the scene reaches to the lamp's plane.
const LEAST_NEAR_OF_DIAGONAL: f32 = 1e-4;

/// The cameras of a rectangle light: all look along its normal and have one focal length. Lens shift lets each of them see the whole
/// scene on the side to which the rectangle shines, up to [`MAX_LAMP_SLOPE`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LampRig {
    center_in_world: Vec3,
    half_edges_in_world: [Vec3; 2],
    bounds: Aabb,
    world_from_camera: Quat,
    focal_px: Vec2,
    near_m: f32,
    side_px: u32,
}

/// The slopes, to the right and up, under which a camera sees the scene.
#[derive(Debug, Clone, Copy)]
struct Slopes {
    least: Vec2,
    greatest: Vec2,
}

impl LampRig {
    /// A rig with square images. `None` for other lights than rectangles, and where the whole scene is behind the rectangle.
    #[must_use]
    pub fn new(light: &Light, bounds: Aabb, side_px: u32) -> Option<Self> {
        let &Light::Rectangle { center_in_world, half_edges_in_world, .. } = light else { return None };
        let [u, v] = half_edges_in_world;
        let forward = u.cross(v).try_normalize()?;
        let right = u.try_normalize()?;
        let up = forward.cross(-right);
        let world_from_camera = Quat::from_mat3a(&Mat3A::from_cols(right.into(), up.into(), (-forward).into()));
        let depths_m = bounds.corners().map(|corner| forward.dot(corner - center_in_world));
        let greatest_depth_m = depths_m.into_iter().fold(f32::NEG_INFINITY, f32::max);
        if greatest_depth_m <= 0.0 {
            return None;
        }
        let least_depth_m = depths_m.into_iter().fold(f32::INFINITY, f32::min);
        let near_m = (0.5 * least_depth_m).max(LEAST_NEAR_OF_DIAGONAL * bounds.size().length()).max(f32::MIN_POSITIVE);
        let unscaled = Self {
            center_in_world,
            half_edges_in_world,
            bounds,
            world_from_camera: world_from_camera.normalize(),
            focal_px: Vec2::ONE,
            near_m,
            side_px,
        };
        // Below the bound of slopes their extent is a convex function of the place, which is greatest at a corner; beyond it may be
        // greatest in between.
        let places = (0..9).map(|i| Vec2::new((i % 3) as f32, (i / 3) as f32) * 0.5);
        let slopes = places.map(|place| unscaled.slopes_from(unscaled.eye_at(place)));
        let extent = slopes.fold(Vec2::ZERO, |extent, slopes| extent.max(slopes.greatest - slopes.least));
        Some(Self { focal_px: Vec2::splat(side_px as f32) / extent.max(Vec2::splat(1e-6)), ..unscaled })
    }

    /// The camera at a place of the rectangle, from (0, 0) to (1, 1).
    #[must_use]
    pub fn camera(&self, place: Vec2) -> PinholeCamera {
        let eye_in_world = self.eye_at(place);
        let slopes = self.slopes_from(eye_in_world);
        let middle = 0.5 * (slopes.least + slopes.greatest);
        PinholeCamera {
            eye_in_world,
            world_from_camera: self.world_from_camera,
            focal_px: self.focal_px,
            principal_px: Vec2::splat(0.5 * self.side_px as f32) - self.focal_px * Vec2::new(middle.x, -middle.y),
            size_px: UVec2::splat(self.side_px),
            near_m: self.near_m,
        }
    }

    /// The cameras at the four corners, between which all points of the rectangle lie.
    #[must_use]
    pub fn corners(&self) -> [PinholeCamera; 4] {
        CORNERS.map(|place| self.camera(place))
    }

    fn eye_at(&self, place: Vec2) -> Vec3 {
        let square = place * 2.0 - 1.0;
        self.center_in_world + self.half_edges_in_world[0] * square.x + self.half_edges_in_world[1] * square.y
    }

    /// A scene that reaches behind the near plane is seen under all slopes.
    fn slopes_from(&self, eye_in_world: Vec3) -> Slopes {
        let mut least = Vec2::INFINITY;
        let mut greatest = Vec2::NEG_INFINITY;
        for corner in self.bounds.corners() {
            let in_camera = self.world_from_camera.conjugate() * (corner - eye_in_world);
            let depth_m = -in_camera.z;
            if depth_m < self.near_m {
                least = Vec2::NEG_INFINITY;
                greatest = Vec2::INFINITY;
                break;
            }
            least = least.min(in_camera.truncate() / depth_m);
            greatest = greatest.max(in_camera.truncate() / depth_m);
        }
        let most = Vec2::splat(MAX_LAMP_SLOPE);
        Slopes { least: least.clamp(-most, most), greatest: greatest.clamp(-most, most) }
    }
}

const CORNERS: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(center_in_world: Vec3, half_side_m: f32) -> Light {
        let half_edges_in_world = [Vec3::X * half_side_m, Vec3::Z * half_side_m];
        Light::Rectangle { center_in_world, half_edges_in_world, radiance_linear: Vec3::ONE }
    }

    const BOX: Aabb = Aabb { min: Vec3::new(-1.0, 0.0, -2.0), max: Vec3::new(1.0, 1.0, 2.0) };

    #[test]
    fn every_camera_sees_the_whole_scene_below() {
        let rig = LampRig::new(&lamp(Vec3::Y * 4.0, 1.5), BOX, 256).unwrap();
        let places = (0..=4).flat_map(|x| (0..=4).map(move |y| Vec2::new(x as f32, y as f32) / 4.0));
        for place in places {
            let camera = rig.camera(place);
            camera.validate().unwrap();
            assert!(camera.forward_in_world().abs_diff_eq(Vec3::NEG_Y, 1e-5));
            for corner in BOX.corners() {
                let seen = camera.project(corner).unwrap();
                let inside = seen.pixel.cmpge(Vec2::splat(-0.01)).all() && seen.pixel.cmple(Vec2::splat(256.01)).all();
                assert!(inside && seen.planar_depth_m > camera.near_m, "{place}: {seen:?}");
            }
        }
        assert_eq!(rig.corners()[3], rig.camera(Vec2::ONE));
        assert_eq!(rig.corners()[1].eye_in_world, Vec3::new(1.5, 4.0, -1.5));
    }

    #[test]
    fn a_lamp_within_the_scene_sees_80_degrees_to_each_side() {
        let rig = LampRig::new(&lamp(Vec3::Y * 0.5, 0.1), BOX, 100).unwrap();
        let camera = rig.camera(Vec2::splat(0.5));
        camera.validate().unwrap();
        let edge = (camera.size_px.as_vec2() - camera.principal_px) / camera.focal_px;
        assert!((edge - MAX_LAMP_SLOPE).abs().max_element() < 1e-3, "{edge}");
        assert!(camera.near_m > 0.0);
    }

    #[test]
    fn other_lights_and_scenes_behind_have_no_rig() {
        assert_eq!(LampRig::new(&lamp(Vec3::NEG_Y, 1.0), BOX, 64), None, "it shines down");
        let point = Light::Point { position_in_world: Vec3::Y, intensity_linear: Vec3::ONE, radius_m: 0.1 };
        assert_eq!(LampRig::new(&point, BOX, 64), None);
    }
}
