//! Cameras and bounds.

use cluster::limits::{MAX_SAMPLE_CAMERAS, MAX_VIEWPOINTS};
use cluster::{InvalidField, at_most};
use depth_image::{Aabb, Camera, PinholeCamera};
use glam::{Quat, UVec2, Vec2, Vec3};

use crate::error::required;
use crate::proto;

pub(crate) fn vec3_from(v: Option<proto::Vec3>, field: &'static str) -> Result<Vec3, InvalidField> {
    let v = required(v, field)?;
    let v = Vec3::new(v.x, v.y, v.z);
    if v.is_finite() { Ok(v) } else { Err(InvalidField::out_of_range(field, v, "finite")) }
}

pub(crate) fn vec3_to(v: Vec3) -> Option<proto::Vec3> {
    Some(proto::Vec3 { x: v.x, y: v.y, z: v.z })
}

fn vec2_from(v: Option<proto::Vec2>, field: &'static str) -> Result<Vec2, InvalidField> {
    required(v, field).map(|v| Vec2::new(v.x, v.y))
}

fn vec2_to(v: Vec2) -> Option<proto::Vec2> {
    Some(proto::Vec2 { x: v.x, y: v.y })
}

/// A validated pinhole camera out of an optional field.
pub(crate) fn pinhole_from(
    camera: Option<proto::PinholeCamera>,
    field: &'static str,
) -> Result<PinholeCamera, InvalidField> {
    let camera = required(camera, field)?;
    let eye = required(camera.eye_in_world_m, "camera.eye_in_world_m")?;
    let turn = required(camera.world_from_camera_unit, "camera.world_from_camera_unit")?;
    let camera = PinholeCamera {
        eye_in_world: Vec3::new(eye.x, eye.y, eye.z),
        world_from_camera: Quat::from_xyzw(turn.x, turn.y, turn.z, turn.w),
        focal_px: vec2_from(camera.focal_px, "camera.focal_px")?,
        principal_px: vec2_from(camera.principal_px, "camera.principal_px")?,
        size_px: UVec2::new(camera.width_px, camera.height_px),
        near_m: camera.near_m,
    };
    camera.validate().map_err(|source| InvalidField::Camera { field, source })?;
    Ok(camera)
}

pub(crate) fn pinhole_to(camera: &PinholeCamera) -> proto::PinholeCamera {
    let q = camera.world_from_camera;
    proto::PinholeCamera {
        eye_in_world_m: vec3_to(camera.eye_in_world),
        world_from_camera_unit: Some(proto::Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }),
        focal_px: vec2_to(camera.focal_px),
        principal_px: vec2_to(camera.principal_px),
        width_px: camera.size_px.x,
        height_px: camera.size_px.y,
        near_m: camera.near_m,
    }
}

fn camera_from(camera: proto::Camera) -> Result<Camera, InvalidField> {
    match required(camera.model, "camera.model")? {
        proto::camera::Model::Pinhole(pinhole) => pinhole_from(Some(pinhole), "camera.pinhole").map(Camera::Pinhole),
    }
}

pub(crate) fn camera_to(camera: &Camera) -> proto::Camera {
    let model = match camera {
        Camera::Pinhole(camera) => proto::camera::Model::Pinhole(pinhole_to(camera)),
    };
    proto::Camera { model: Some(model) }
}

/// Cameras of at most `cells` view cells.
pub(crate) fn sample_cameras_from(cameras: Vec<proto::Camera>, cells: usize) -> Result<Vec<Camera>, InvalidField> {
    at_most(cameras.len(), MAX_SAMPLE_CAMERAS * cells, "sample_cameras")?;
    cameras.into_iter().map(camera_from).collect()
}

/// Viewpoints of a session.
pub(crate) fn viewpoints_from(viewpoints: Vec<proto::PinholeCamera>) -> Result<Vec<PinholeCamera>, InvalidField> {
    at_most(viewpoints.len(), MAX_VIEWPOINTS, "viewpoints")?;
    viewpoints.into_iter().map(|viewpoint| pinhole_from(Some(viewpoint), "viewpoints")).collect()
}

pub(crate) fn bounds_from(bounds: proto::Bounds) -> Result<Aabb, InvalidField> {
    let bounds = Aabb {
        min: vec3_from(bounds.min_in_world_m, "bounds.min_in_world_m")?,
        max: vec3_from(bounds.max_in_world_m, "bounds.max_in_world_m")?,
    };
    if bounds.is_empty() {
        Err(InvalidField::out_of_range("bounds", "empty", "min <= max on every axis"))
    } else {
        Ok(bounds)
    }
}

pub(crate) fn bounds_to(bounds: &Aabb) -> proto::Bounds {
    proto::Bounds { min_in_world_m: vec3_to(bounds.min), max_in_world_m: vec3_to(bounds.max) }
}
