//! Closed forms of the scene's surface under a pixel.

use browser::input::Place;
use browser_tests::visit::Picture;
use cluster::SessionRequest;
use cluster_tests::gateway_bench::PageCamera;
use cluster_tests::scalar_engine::{BALL_RADIUS_M, ball_center};
use depth_image::{PinholeCamera, Ray};
use glam::{DVec3, UVec2, Vec3};

use crate::scene::slow_request;

/// The middle one of the sample cameras, as a link names it: a view from there has a sample in the middle of each pixel.
pub const AT_SAMPLES: &str = "#c=0,1.2,3;0,0.5,0;51.56620156177409";
/// A place of the sky.
pub const SKY: Place = [300.0, 60.0];
/// The greatest distance of a measured point from its closed form: some two pixels on the surface.
pub const TOLERANCE_M: f64 = 0.02;

/// A session with a sample for each pixel of a view of 480 rows.
pub fn dense_request() -> SessionRequest {
    SessionRequest { sample_size_px: Some(UVec2::new(640, 480)), ..slow_request() }
}

/// The camera of a picture.
pub fn camera_of(still: &Picture) -> PinholeCamera {
    PageCamera::from(still.header.camera).of_size(UVec2::from_array(still.header.size_px))
}

/// The ray through the middle of the pixel at a place.
fn ray(camera: &PinholeCamera, place: Place) -> Ray {
    let pixel = DVec3::new(place[0], place[1], 0.0).as_vec3().truncate();
    camera.ray(pixel.floor() + 0.5)
}

/// The ball's surface under a place.
pub fn on_ball(camera: &PinholeCamera, place: Place) -> DVec3 {
    let ray = ray(camera, place);
    let direction = ray.direction_in_world.try_normalize().expect("a direction");
    let to_middle = ball_center(0.0) - ray.origin_in_world;
    let along_m = to_middle.dot(direction);
    let aside_m = (to_middle - direction * along_m).length();
    assert!(aside_m < BALL_RADIUS_M, "{place:?} is beside the ball");
    let inside_m = (BALL_RADIUS_M * BALL_RADIUS_M - aside_m * aside_m).sqrt();
    (ray.origin_in_world + direction * (along_m - inside_m)).as_dvec3()
}

/// The floor under a place.
pub fn on_floor(camera: &PinholeCamera, place: Place) -> DVec3 {
    let ray = ray(camera, place);
    assert!(ray.direction_in_world.y < 0.0, "{place:?} is above the horizon");
    ray.at(-ray.origin_in_world.y / ray.direction_in_world.y).as_dvec3()
}

/// Where a point is in the picture.
pub fn place_of(camera: &PinholeCamera, point: Vec3) -> Place {
    let at = camera.project(point).expect("in front of the camera").pixel;
    [f64::from(at.x), f64::from(at.y)]
}
