//! The camera that sees behind an object, for ambient occlusion (Rosen et al., section 6.3, Figure 14).

use depth_image::{Aabb, PinholeCamera};
use glam::{DVec2, DVec3};

use super::camera::{FrustumPlan, GraphPlan, RootPlan};
use super::plane::Plane;

/// A view up to the plane through the middle of a box, and behind it two halves on either side of the upright line through that middle.
/// Their eyes lie beside the view's, outwards, by this share of the distance to the middle.
pub fn behind(view: &PinholeCamera, bounds: &Aabb, offset: f64) -> GraphPlan {
    let eye = view.eye_in_world.as_dvec3();
    let forward = view.forward_in_world().as_dvec3();
    let right = (view.world_from_camera * glam::Vec3::X).as_dvec3();
    let middle = bounds.center().as_dvec3();
    let distance_m = forward.dot(middle - eye);
    let far_m = distance_m + bounds.size().as_dvec3().length();
    let size = view.size_px.as_dvec2();
    let split_px = f64::from(view.principal_px.x)
        + f64::from(view.focal_px.x) * right.dot(middle - eye) / distance_m.max(f64::MIN_POSITIVE);
    let halves = [([0.0, split_px], -1.0), ([split_px, size.x], 1.0)];
    let frusta = halves.map(|([left, end], side)| {
        let corners = [(left, 0.0), (end, 0.0), (end, size.y), (left, size.y)];
        let wall = Plane::through(point_at(view, DVec2::new(split_px, 0.0), distance_m), right * side);
        FrustumPlan {
            parent: 0,
            eye_in_world: eye + right * (side * offset * distance_m),
            face: corners.map(|(column, row)| point_at(view, DVec2::new(column, row), distance_m)).to_vec(),
            walls: vec![wall],
            far_m,
        }
    });
    let root = RootPlan { camera: *view, walls: Vec::new(), far_m: distance_m };
    GraphPlan { root, frusta: frusta.into() }
}

/// The point of a view at a planar depth.
fn point_at(view: &PinholeCamera, pixel: DVec2, planar_depth_m: f64) -> DVec3 {
    let slope = (pixel - view.principal_px.as_dvec2()) / view.focal_px.as_dvec2();
    let way = view.world_from_camera.as_dquat() * DVec3::new(slope.x, -slope.y, -1.0);
    view.eye_in_world.as_dvec3() + way * planar_depth_m
}
