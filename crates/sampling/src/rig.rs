//! Places of sample cameras.

use depth_image::{Aabb, PinholeCamera};
use glam::{Affine3A, UVec2, Vec2, Vec3, Vec3Swizzles as _};

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
/// The greatest share of a frame's height and width that a model reaches, seen from the middle of its rig.
const FRAMED_SHARE: f32 = 0.9;
/// The same, seen from a corner.
const CORNER_SHARE: f32 = 0.98;
/// The greatest width of a frame over its height: that of views by default. Wider views show more on both sides.
const FRAME_ASPECT: f32 = 4.0 / 3.0;
/// The direction from a model to the eye: a three-quarter view, 25° from the front and 30° above.
const THREE_QUARTER: Vec3 = Vec3::new(0.3660, 0.5, 0.7849);
/// The height of a block's cameras over its highest point, in halves of its width: as the paper's over their tile.
const BLOCK_CLEARANCE: f32 = 3.0;
/// The widest field of view of a block's cameras; those of flat blocks are narrower.
const MAX_BLOCK_FOV_RAD: f32 = 2.0;
/// The least distance from an eye to a model's nearest point, in radii of the model.
const LEAST_GAP_RADII: f32 = 0.5;

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

    /// Over each block of a grid of columns and rows on the ground of a volume, row after row: above its corners, three halves of its
    /// width over its highest point, with all of it in view. `points_in_world` are the scene's vertices; a block without any is as
    /// high as the volume. `size_px` is the size of the sample images.
    ///
    /// # Errors
    /// When the volume is empty.
    pub fn of_blocks(
        volume: &Aabb,
        grid: UVec2,
        points_in_world: impl Iterator<Item = Vec3>,
        size_px: UVec2,
    ) -> Result<Vec<(Aabb, Self)>, RigError> {
        check(volume)?;
        let side = volume.size() / Vec3::new(grid.x as f32, 1.0, grid.y as f32);
        let mut heights = vec![Aabb::EMPTY; grid.element_product() as usize];
        for point in points_in_world {
            let place = ((point - volume.min) / side.max(Vec3::splat(f32::MIN_POSITIVE))).as_uvec3().xz().min(grid - 1);
            let height = &mut heights[(place.y * grid.x + place.x) as usize];
            *height = height.grown_to(point);
        }
        let blocks = (0..).zip(heights).map(|(number, height)| {
            let min = volume.min + side * Vec3::new((number % grid.x) as f32, 0.0, (number / grid.x) as f32);
            let block = Aabb { min, max: min + side };
            let top = if height.is_empty() { block.max.y } else { height.max.y };
            let half_m = 0.5 * side.x.max(side.z);
            let over = Self::two_plane(&block, (top - block.min.y) / half_m + BLOCK_CLEARANCE)?;
            let fov_y_rad = over.fov_for(&Aabb { max: block.max.with_y(top), ..block }, size_px);
            Ok((block, Self { fov_y_rad, ..over }))
        });
        blocks.collect()
    }

    /// As [`Self::two_plane`], as high over a volume as the highest cameras of its blocks: views between them fly over it.
    ///
    /// # Errors
    /// When the volume is empty.
    pub fn over_blocks(volume: &Aabb, blocks: &[(Aabb, Self)]) -> Result<Self, RigError> {
        let top = blocks.iter().map(|(_, rig)| rig.center_in_world.y).fold(volume.max.y, f32::max);
        let size = volume.size();
        Self::two_plane(volume, 2.0 * (top - volume.min.y) / size.x.max(size.z))
    }

    /// The field of view in which all four cameras see all of a box, for images of a size.
    fn fov_for(&self, seen: &Aabb, size_px: UVec2) -> f32 {
        let aspect = size_px.x as f32 / size_px.y.max(1) as f32;
        let slopes = self.samples(size_px).into_iter().flat_map(|camera| {
            seen.corners().map(|corner| {
                let in_camera = camera.world_from_camera.conjugate() * (corner - camera.eye_in_world);
                (in_camera.x.abs() / aspect).max(in_camera.y.abs()) / (-in_camera.z).max(f32::MIN_POSITIVE)
            })
        });
        (2.0 * slopes.fold(0.0, f32::max).atan()).min(MAX_BLOCK_FOV_RAD)
    }

    /// Around a camera that a scene names, which may stand within it: neighbouring cameras see what is `distance_m` before it
    /// 2 · `spread_rad` apart.
    #[must_use]
    pub fn around(world_from_camera: &Affine3A, fov_y_rad: f32, distance_m: f32, spread_rad: f32) -> Self {
        let [right, up, backwards] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| world_from_camera.transform_vector3(axis));
        let center_in_world = world_from_camera.transform_point3(Vec3::ZERO);
        let half = distance_m * spread_rad.tan();
        Self {
            center_in_world,
            half_edges_in_world: [right * half, up * half],
            target_in_world: center_in_world - backwards * distance_m,
            fov_y_rad,
            near_m: distance_m * 0.02,
        }
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

    /// A three-quarter view of a model, a little above its middle. The model reaches 90 % of the frame's height or width,
    /// and no camera of the rig cuts it off. Neighbouring cameras see its middle 2 · `spread_rad` apart. `points_in_world` are the model's vertices,
    /// or other points whose hull has them all; `size_px` is the size of the sample images.
    ///
    /// # Errors
    /// When the volume of the points is empty.
    pub fn framing(
        points_in_world: impl Iterator<Item = Vec3> + Clone,
        spread_rad: f32,
        size_px: UVec2,
    ) -> Result<Self, RigError> {
        let volume = Aabb::around(points_in_world.clone());
        check(&volume)?;
        let aspect = (size_px.x as f32 / size_px.y.max(1) as f32).min(FRAME_ASPECT);
        let slopes = Vec2::new(aspect, 1.0) * (FOV_Y_RAD * 0.5).tan();
        let radius_m = volume.size().length() * 0.5;
        let backwards = THREE_QUARTER.normalize_or(Vec3::Z);
        let right = Vec3::Y.cross(backwards).normalize_or(Vec3::X);
        let up = backwards.cross(right);
        let axes = [right, up, backwards];
        let seen = Extent::of(points_in_world.clone(), volume.center(), axes, slopes * FRAMED_SHARE);
        let target = volume.center() + right * seen.off_center.x + up * seen.off_center.y;
        let spread = spread_rad.tan();
        let places = [(0.0, 0.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
        let distance_m = places.into_iter().fold(0.0f32, |most, (x, y)| {
            let towards_eye = backwards + (right * x + up * y) * spread;
            let axis = towards_eye.normalize_or(Vec3::Z);
            let length = towards_eye.length();
            let side = up.cross(axis).normalize_or(Vec3::X);
            let share = if x == 0.0 { FRAMED_SHARE } else { CORNER_SHARE };
            let axes = [side, axis.cross(side), axis];
            let seen = Extent::of(points_in_world.clone(), target, axes, slopes * share);
            most.max(seen.distance_m.max(seen.nearest_m + LEAST_GAP_RADII * radius_m) / length)
        });
        let half = distance_m * spread;
        Ok(Self {
            center_in_world: target + backwards * distance_m,
            half_edges_in_world: [right * half, up * half],
            target_in_world: target,
            fov_y_rad: FOV_Y_RAD,
            near_m: LEAST_GAP_RADII * radius_m * 0.25,
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

/// What a camera that looks at the middle of some points must do to see all of them.
struct Extent {
    /// The least distance of the eye from the middle.
    distance_m: f32,
    /// The point to look at, to the right and above the middle, so that the points are in the middle of the picture.
    off_center: Vec2,
    /// The greatest offset of a point towards the eye.
    nearest_m: f32,
}

impl Extent {
    /// `axes` lead right, up and towards the eye; `slopes` are the frame's half sides at unit distance. A point at
    /// (x, y, z) on the axes from the middle is inside from a distance of |x| / slope + z, and of |y| / slope + z.
    fn of(points: impl Iterator<Item = Vec3>, middle: Vec3, [right, up, backwards]: [Vec3; 3], slopes: Vec2) -> Self {
        let mut high = Vec2::MIN;
        let mut low = Vec2::MIN;
        let mut nearest_m = f32::MIN;
        for offset in points.map(|point| point - middle) {
            let across = Vec2::new(right.dot(offset), up.dot(offset)) / slopes;
            let towards_eye_m = backwards.dot(offset);
            high = high.max(across + towards_eye_m);
            low = low.max(towards_eye_m - across);
            nearest_m = nearest_m.max(towards_eye_m);
        }
        let off_center = (high - low) * 0.5 * slopes;
        Self { distance_m: high.max(low).max_element(), off_center, nearest_m }
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
    fn blocks_fill_the_volume_and_their_cameras_stand_above_it() {
        let volume = Aabb { min: Vec3::new(-3.0, 0.0, -1.0), max: Vec3::new(3.0, 5.0, 1.0) };
        let tower = [Vec3::new(2.9, 5.0, 0.9), Vec3::new(-2.9, 0.5, -0.9)];
        let size_px = UVec2::new(40, 30);
        let of = |volume: &Aabb, grid| Rig::of_blocks(volume, grid, tower.into_iter(), size_px);
        let blocks = of(&volume, UVec2::new(3, 2)).expect("blocks");
        assert_eq!(blocks.len(), 6);
        let filled: f32 = blocks.iter().map(|(block, _)| block.size().element_product()).sum();
        assert!((filled - volume.size().element_product()).abs() < 1e-3);
        assert_eq!(blocks[4].0, Aabb { min: Vec3::new(-1.0, 0.0, 0.0), max: Vec3::new(1.0, 5.0, 1.0) });
        for (number, top) in [(0, 0.5), (1, 5.0), (5, 5.0)] {
            let (block, rig) = &blocks[number];
            for camera in rig.samples(size_px) {
                camera.validate().expect("valid");
                assert!((camera.eye_in_world.y - top - 3.0).abs() < 1e-4, "{number}: {camera:?}");
                for corner in (Aabb { max: block.max.with_y(top), ..*block }).corners() {
                    let at = camera.project(corner).expect("in front").pixel;
                    assert!(at.cmpge(Vec2::splat(-1e-3)).all() && at.cmple(size_px.as_vec2() + 1e-3).all(), "{at}");
                }
            }
        }
        assert_eq!(of(&Aabb::EMPTY, UVec2::ONE), Err(RigError));
    }

    #[test]
    fn a_rig_is_found_again_from_its_cameras() {
        let block = Aabb { min: Vec3::new(-1.0, 0.0, -2.0), max: Vec3::new(1.0, 1.0, 2.0) };
        let size_px = UVec2::new(40, 30);
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
}
