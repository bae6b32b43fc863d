//! Cameras in the convention of `transforms.json`.

use depth_image::{PinholeCamera, SourceSpace};
use glam::DMat3;
use serde_json::{Map, Value, json};

/// The fields of a camera's frame in a `transforms.json`: sides, focal lengths and principal point in pixels, and the
/// camera-to-world matrix of OpenGL's convention, in the space of the scene's file.
#[must_use]
pub fn camera_frame(camera: &PinholeCamera, source_space: SourceSpace) -> Map<String, Value> {
    let axes = DMat3::from_quat(camera.world_from_camera.as_dquat().normalize());
    let eye = source_space.source_from_world(camera.eye_in_world);
    let [x, y, z] = [0, 1, 2].map(|i| json!([axes.x_axis[i], axes.y_axis[i], axes.z_axis[i], eye[i]]));
    let size_px = camera.size_px;
    let focal_px = camera.focal_px;
    let principal_px = camera.principal_px;
    let fields = json!({
        "w": size_px.x, "h": size_px.y,
        "fl_x": focal_px.x, "fl_y": focal_px.y, "cx": principal_px.x, "cy": principal_px.y,
        "transform_matrix": [x, y, z, [0.0, 0.0, 0.0, 1.0]],
    });
    fields.as_object().cloned().unwrap_or_default()
}
