//! Writing camera files.

use std::path::Path;

use depth_image::PinholeCamera;
use glam::{DMat3, DVec3};
use serde_json::{Map, Value, json};

use super::error::{CameraFault, CameraFileError};

/// A camera to write, with further fields.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCamera {
    /// The path of the camera's picture.
    pub file_path: String,
    /// The camera.
    pub camera: PinholeCamera,
    /// Further fields of the frame.
    pub more: Map<String, Value>,
}

/// Writes cameras in the convention of `transforms.json`; `more` goes beside the frames.
///
/// # Errors
/// The file cannot be written.
pub fn write(
    path: &Path,
    cameras: &[NamedCamera],
    origin_in_source: DVec3,
    more: Map<String, Value>,
) -> Result<(), CameraFileError> {
    let mut file = more;
    file.insert("camera_model".to_owned(), json!("OPENCV"));
    file.insert("frames".to_owned(), cameras.iter().map(|named| frame_of(named, origin_in_source)).collect());
    let written =
        serde_json::to_vec_pretty(&file).map_err(CameraFault::from).and_then(|text| Ok(std::fs::write(path, text)?));
    written.map_err(|kind| CameraFileError { file: path.display().to_string(), place: "file".to_owned(), kind })
}

fn frame_of(named: &NamedCamera, origin_in_source: DVec3) -> Value {
    let camera = &named.camera;
    let axes = DMat3::from_quat(camera.world_from_camera.as_dquat().normalize());
    let eye = camera.eye_in_world.as_dvec3() + origin_in_source;
    let row = |i: usize| json!([axes.x_axis[i], axes.y_axis[i], axes.z_axis[i], eye[i]]);
    let mut frame = named.more.clone();
    let fields = json!({
        "file_path": named.file_path, "w": camera.size_px.x, "h": camera.size_px.y,
        "fl_x": camera.focal_px.x, "fl_y": camera.focal_px.y, "cx": camera.principal_px.x, "cy": camera.principal_px.y,
        "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
    });
    frame.extend(fields.as_object().cloned().unwrap_or_default());
    Value::Object(frame)
}
