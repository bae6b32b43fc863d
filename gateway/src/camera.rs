//! Cameras as pages and links name them, and the sizes of pictures.

use cluster::OfferStatus;
use depth_image::{PinholeCamera, SourceSpace, ViewCell};
use glam::{DVec3, UVec2, Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// The field of view of a page that chooses none, in degrees.
const FOV_Y_DEG: f64 = 45.0;
/// The greatest coordinate of a camera, in the scene file's unit and in metres.
const FARTHEST: f64 = 1e12;
/// The longest side of a page's canvas.
const MAX_CANVAS_PX: u32 = 16_384;

/// An upright camera, in the coordinates of the scene's file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PageCamera {
    /// The place of the eye.
    pub(crate) eye: [f64; 3],
    /// A point in the middle of the picture.
    pub(crate) target: [f64; 3],
    /// The full vertical field of view.
    pub(crate) fov_y_deg: f64,
}

/// Why a camera or a size cannot be used.
fn bad(field: &str, value: impl std::fmt::Debug, allowed: &str) -> String {
    format!("{field} is {value:?}, must be {allowed}")
}

/// The world of a scene on offer, as views need it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ViewSpace {
    pub(crate) source_space: SourceSpace,
    near_m: f32,
}

impl ViewSpace {
    pub(crate) fn of(offer: &OfferStatus) -> Self {
        Self { source_space: offer.source_space, near_m: offer.volume.near_m() }
    }

    /// The camera of a view of this size.
    ///
    /// # Errors
    /// For numbers that are not finite or out of range, a sentence that begins with the field.
    pub(crate) fn camera(&self, page: &PageCamera, size_px: UVec2) -> Result<PinholeCamera, String> {
        if !(1.0..=170.0).contains(&page.fov_y_deg) {
            return Err(bad("fov_y_deg", page.fov_y_deg, "from 1 to 170"));
        }
        if size_px.min_element() == 0 || size_px.max_element() > MAX_CANVAS_PX {
            return Err(bad("size", size_px.to_array(), "1 to 16384 pixels a side"));
        }
        let eye = self.point("eye", page.eye)?;
        let target = self.point("target", page.target)?;
        let camera = PinholeCamera::looking_at(eye, target, Vec3::Y, page.fov_y_deg.to_radians() as f32, size_px);
        let camera = PinholeCamera { near_m: self.near_m, ..camera };
        camera.validate().map_err(|error| bad("camera", error.to_string(), "a camera"))?;
        Ok(camera)
    }

    fn point(&self, field: &str, point: [f64; 3]) -> Result<Vec3, String> {
        let in_world = self.source_space.world_from_source(DVec3::from_array(point));
        let is_near = point.iter().all(|v| v.abs() <= FARTHEST) && in_world.abs().max_element() <= FARTHEST as f32;
        let allowed = "within ±1e12, and not further from the model for its size";
        if is_near { Ok(in_world) } else { Err(bad(field, point, allowed)) }
    }

    /// A camera in front of the scene: in the middle of its sample cameras, looking at the scene's middle.
    pub(crate) fn home(&self, offer: &OfferStatus) -> PageCamera {
        let samples: Vec<_> = offer.sample_cameras.iter().map(|camera| *camera.reference()).collect();
        let middle = offer.volume.center();
        let middle_camera = ViewCell::between(&samples).map(|cell| cell.camera_at(Vec2::ZERO, UVec2::splat(2)));
        let (eye, target) = match middle_camera {
            Some(camera) => {
                let distance_m = (middle - camera.eye_in_world).dot(camera.forward_in_world()).max(camera.near_m);
                (camera.eye_in_world, camera.eye_in_world + camera.forward_in_world() * distance_m)
            }
            None => (middle + Vec3::Z * offer.volume.size().length(), middle),
        };
        let fov_y_deg = middle_camera.map_or(FOV_Y_DEG, |camera| {
            f64::from((camera.size_px.y as f32 * 0.5 / camera.focal_px.y).atan() * 2.0).to_degrees()
        });
        PageCamera { eye: self.in_source(eye), target: self.in_source(target), fov_y_deg }
    }

    /// A point of the world, in the coordinates of the scene's file.
    pub(crate) fn in_source(&self, point_in_world: Vec3) -> [f64; 3] {
        self.source_space.source_from_world(point_in_world).to_array()
    }
}

/// The canvas's size, made smaller where it is larger than a still may be, in its own shape.
pub(crate) fn still_size(canvas_px: UVec2, max_px: UVec2) -> UVec2 {
    let scale = (max_px.as_vec2() / canvas_px.as_vec2()).min_element().min(1.0);
    (canvas_px.as_vec2() * scale).round().as_uvec2().max(UVec2::ONE).min(max_px)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) const CAMERA: PageCamera =
        PageCamera { eye: [100.0, 2.0, 3.0], target: [100.0, 0.0, 0.0], fov_y_deg: 40.0 };

    fn space() -> ViewSpace {
        ViewSpace { source_space: SourceSpace::moved(DVec3::new(100.0, 0.0, 0.0)), near_m: 0.01 }
    }

    #[test]
    fn a_camera_is_moved_to_the_origin_of_the_world() {
        let camera = space().camera(&CAMERA, UVec2::new(64, 32)).unwrap();
        assert_eq!(camera.eye_in_world, Vec3::new(0.0, 2.0, 3.0));
        let at = camera.project(Vec3::ZERO).unwrap();
        assert!((at.pixel - Vec2::new(32.0, 16.0)).length() < 1e-3, "{at:?}");
        assert_eq!(space().in_source(camera.eye_in_world), CAMERA.eye);
    }

    #[test]
    fn numbers_out_of_range_are_refused_by_name() {
        let size_px = UVec2::new(64, 32);
        let refused = |camera: PageCamera, size_px| {
            let error = space().camera(&camera, size_px).unwrap_err();
            error.split(' ').next().unwrap().to_owned()
        };
        assert_eq!(refused(PageCamera { eye: [f64::NAN; 3], ..CAMERA }, size_px), "eye");
        assert_eq!(refused(PageCamera { target: [1e300; 3], ..CAMERA }, size_px), "target");
        assert_eq!(refused(PageCamera { fov_y_deg: 180.0, ..CAMERA }, size_px), "fov_y_deg");
        assert_eq!(refused(CAMERA, UVec2::new(0, 5)), "size");
        assert_eq!(refused(CAMERA, UVec2::splat(1 << 20)), "size");
    }

    #[test]
    fn an_eye_at_its_target_makes_a_camera_all_the_same() {
        let camera = PageCamera { target: CAMERA.eye, ..CAMERA };
        assert!(space().camera(&camera, UVec2::splat(9)).unwrap().validate().is_ok());
    }

    #[test]
    fn a_still_keeps_the_shape_of_its_canvas() {
        let most = UVec2::new(1920, 1080);
        assert_eq!(still_size(UVec2::new(640, 360), most), UVec2::new(640, 360));
        assert_eq!(still_size(UVec2::new(3840, 1080), most), UVec2::new(1920, 540));
        assert_eq!(still_size(UVec2::new(1, 10_000), most), UVec2::new(1, 1080));
    }
}
