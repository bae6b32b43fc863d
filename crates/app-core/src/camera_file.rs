//! Camera files: nerfstudio's `transforms.json` and its camera paths, so that anyone can run someone else's experiment.
//!
//! `transform_matrix` is camera to world, the camera looking down −Z with +Y up, as rows or as 16 numbers. Focal lengths and
//! principal points are in pixels, for a frame or for all; angles of view may stand in place of focal lengths. Only pinhole
//! cameras can be used: distortion that is not zero is refused by name. Files are in the scene file's own space: the origin and
//! unit of a re-centred or scaled scene apply in double precision.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use depth_image::{CameraError, MAX_IMAGE_SIDE_PX, PinholeCamera, SourceSpace};
use glam::{DMat3, DQuat, DVec2, DVec3, DVec4, UVec2, Vec2};
use serde_json::{Map, Value};

/// The most bytes of a camera file: a thousand cameras take about 0.5 MB.
pub const MAX_FILE_BYTES: u64 = 32 << 20;
/// The most cameras of a file.
const MAX_FRAMES: usize = 65_536;
/// The tolerance of a matrix's axes to unit length and right angles.
const RIGID_TOLERANCE: f64 = 1e-3;
/// Pinholes, where their distortion is zero.
const MODELS: [&str; 6] = ["FULL_OPENCV", "OPENCV", "PINHOLE", "RADIAL", "SIMPLE_PINHOLE", "SIMPLE_RADIAL"];
const DISTORTIONS: [&str; 8] = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"];
const MATRIX: &str = "transform_matrix";

/// Facts that a camera file does not state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The file's space, which is that of the scene's file.
    pub source_space: SourceSpace,
    /// The distance to the near plane.
    pub near_m: f32,
    /// The size of frames that state none.
    pub size_px: UVec2,
}

/// A camera file that cannot be used, with the place of the fault.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}: {kind}")]
pub struct CameraFileError {
    /// The path of the file.
    pub file: String,
    /// `frame 3, fl_x`, or the part outside frames.
    pub place: String,
    /// The reason, which the text ends with: it is no source.
    pub kind: CameraFault,
}

/// A fault of a camera file.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum CameraFault {
    /// The operating system refused access.
    #[error("cannot be read or written: {0}")]
    Io(#[from] std::io::Error),
    /// The file is not JSON.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    /// A size or a number is over its limit.
    #[error("{actual} is over the limit of {limit}")]
    TooLarge { actual: u64, limit: u64 },
    /// A required field is missing.
    #[error("is missing")]
    Missing,
    /// A number is NaN, infinite, or of another type.
    #[error("is {0}, must be a finite number")]
    NotFinite(String),
    /// A value is outside the range of its field.
    #[error("is {value}, must be {allowed}")]
    OutOfRange { value: String, allowed: &'static str },
    /// A pinhole camera has no such model or distortion.
    #[error("{0} is not supported: cameras here are pinholes without distortion")]
    Unsupported(String),
    /// A record of views was changed by hand.
    #[error("is not as `myriorama view` writes it")]
    NotAsWritten,
    /// The camera as a whole is not valid.
    #[error(transparent)]
    Camera(#[from] CameraError),
}

impl CameraFileError {
    pub(crate) fn in_file(self, path: &Path) -> Self {
        Self { file: path.display().to_string(), ..self }
    }
}

/// A fault at a place, before the file is named.
pub(crate) fn fault(place: impl Into<String>, kind: impl Into<CameraFault>) -> CameraFileError {
    CameraFileError { file: String::new(), place: place.into(), kind: kind.into() }
}

/// Reads all cameras of a file.
///
/// # Errors
/// The error names the file, the frame, the field and the reason.
pub fn read(path: &Path, placement: Placement) -> Result<Vec<PinholeCamera>, CameraFileError> {
    text_of(path).and_then(|text| parse(&text, placement)).map_err(|error| error.in_file(path))
}

fn text_of(path: &Path) -> Result<String, CameraFileError> {
    let mut text = String::new();
    // One byte more than allowed: a pipe has no length to check first.
    let read = File::open(path).and_then(|file| file.take(MAX_FILE_BYTES + 1).read_to_string(&mut text));
    read.map_err(|error| fault("file", error))?;
    at_most("file", text.len() as u64, MAX_FILE_BYTES)?;
    Ok(text)
}

fn at_most(place: &str, actual: u64, limit: u64) -> Result<(), CameraFileError> {
    if actual > limit { Err(fault(place, CameraFault::TooLarge { actual, limit })) } else { Ok(()) }
}

fn parse(text: &str, placement: Placement) -> Result<Vec<PinholeCamera>, CameraFileError> {
    let text = text.trim_start_matches('\u{feff}');
    let json: Value = serde_json::from_str(&without_nan(text)).map_err(|error| fault("file", error))?;
    let shared = json.as_object().ok_or_else(|| fault("file", CameraFault::Missing))?;
    let frames = shared.get("frames").or_else(|| shared.get("camera_path"));
    let frames = frames.and_then(Value::as_array).filter(|frames| !frames.is_empty());
    let frames = frames.ok_or_else(|| fault("frames", CameraFault::Missing))?;
    at_most("frames", frames.len() as u64, MAX_FRAMES as u64)?;
    let cameras = frames.iter().enumerate().map(|(index, frame)| {
        let own = frame.as_object().ok_or_else(|| fault(format!("frame {index}"), CameraFault::Missing))?;
        Frame { index, own, shared }.camera(placement)
    });
    cameras.collect()
}

/// Replaces NaN and Infinity, which Python writes and JSON does not have, by `null`: they are reported with frame and
/// field. Strings of camera files hold no escaped quotes.
fn without_nan(text: &str) -> String {
    let parts = text.split('"').enumerate().map(|(index, part)| match index % 2 {
        0 => part.replace("-Infinity", "null").replace("Infinity", "null").replace("NaN", "null"),
        _ => part.to_owned(),
    });
    parts.collect::<Vec<_>>().join("\"")
}

/// A frame, and the fields that the file has for all frames.
struct Frame<'a> {
    index: usize,
    own: &'a Map<String, Value>,
    shared: &'a Map<String, Value>,
}

impl Frame<'_> {
    fn fault(&self, field: &str, kind: impl Into<CameraFault>) -> CameraFileError {
        fault(format!("frame {}, {field}", self.index), kind)
    }

    fn out_of_range(&self, field: &str, value: impl Into<String>, allowed: &'static str) -> CameraFileError {
        self.fault(field, CameraFault::OutOfRange { value: value.into(), allowed })
    }

    fn value(&self, field: &str) -> Option<&Value> {
        self.own.get(field).or_else(|| self.shared.get(field))
    }

    fn optional(&self, field: &str) -> Result<Option<f64>, CameraFileError> {
        self.value(field).map(|value| finite(value).map_err(|kind| self.fault(field, kind))).transpose()
    }

    /// The size: `w` and `h` of a `transforms.json`, `render_width` and `render_height` of a camera path.
    fn size_px(&self, default_px: UVec2) -> Result<UVec2, CameraFileError> {
        let width_field = if self.value("w").is_some() { "w" } else { "render_width" };
        let height_field = if self.value("h").is_some() { "h" } else { "render_height" };
        let width_px = self.side_px(width_field, default_px.x)?;
        Ok(UVec2::new(width_px, self.side_px(height_field, default_px.y)?))
    }

    fn side_px(&self, field: &str, default_px: u32) -> Result<u32, CameraFileError> {
        let side = self.optional(field)?.unwrap_or(f64::from(default_px));
        if side.fract() == 0.0 && (1.0..=f64::from(MAX_IMAGE_SIDE_PX)).contains(&side) {
            return Ok(side as u32);
        }
        Err(self.out_of_range(field, side.to_string(), "a whole number from 1 to 16384"))
    }

    fn check_model(&self) -> Result<(), CameraFileError> {
        let model = self.value("camera_model").and_then(Value::as_str).unwrap_or("OPENCV");
        if !MODELS.contains(&model) {
            return Err(self.fault("camera_model", CameraFault::Unsupported(model.to_owned())));
        }
        if self.value("is_fisheye").and_then(Value::as_bool).unwrap_or(false) {
            return Err(self.fault("is_fisheye", CameraFault::Unsupported("a fisheye".to_owned())));
        }
        let kind = self.value("camera_type").and_then(Value::as_str).unwrap_or("perspective");
        if kind != "perspective" {
            return Err(self.fault("camera_type", CameraFault::Unsupported(kind.to_owned())));
        }
        for field in DISTORTIONS {
            if let Some(value) = self.optional(field)?.filter(|value| *value != 0.0) {
                return Err(self.fault(field, CameraFault::Unsupported(format!("{field} = {value}"))));
            }
        }
        Ok(())
    }

    fn camera(&self, placement: Placement) -> Result<PinholeCamera, CameraFileError> {
        self.check_model()?;
        let size_px = self.size_px(placement.size_px)?;
        let focal_px = self.focal_px(size_px)?;
        let principal = [
            self.optional("cx")?.unwrap_or(f64::from(size_px.x) / 2.0),
            self.optional("cy")?.unwrap_or(f64::from(size_px.y) / 2.0),
        ];
        let (rotation, eye_in_source) = self.pose()?;
        let camera = PinholeCamera {
            eye_in_world: placement.source_space.world_from_source(eye_in_source),
            world_from_camera: rotation.as_quat().normalize(),
            focal_px: focal_px.as_vec2(),
            principal_px: Vec2::from_array(principal.map(|v| v as f32)),
            size_px,
            near_m: placement.near_m,
        };
        camera.validate().map_err(|error| self.fault("camera", error))?;
        Ok(camera)
    }

    /// Focal lengths, or those of the angles of view: `camera_angle_x` and `_y` in radians, or a path's vertical `fov` in degrees.
    fn focal_px(&self, size_px: UVec2) -> Result<DVec2, CameraFileError> {
        let mut x = self.optional("fl_x")?;
        let mut y = self.optional("fl_y")?;
        if x.is_none() {
            let fov_y_rad = self.optional("fov")?.map(f64::to_radians);
            let angle_y_rad = self.optional("camera_angle_y")?.or(fov_y_rad);
            x = self.optional("camera_angle_x")?.map(|angle_rad| focal_length_px(angle_rad, size_px.x));
            y = y.or(angle_y_rad.map(|angle_rad| focal_length_px(angle_rad, size_px.y)));
        }
        let x = x.or(y).ok_or_else(|| self.fault("fl_x", CameraFault::Missing))?;
        Ok(DVec2::new(x, y.unwrap_or(x)))
    }

    fn pose(&self) -> Result<(DQuat, DVec3), CameraFileError> {
        let rows = self.rows()?;
        let [x, y, z, eye_in_source] = std::array::from_fn(|i| DVec3::new(rows[0][i], rows[1][i], rows[2][i]));
        let axes = DMat3::from_cols(x, y, z);
        let offs = (axes.transpose() * axes - DMat3::IDENTITY).to_cols_array();
        let off = offs.into_iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let is_last_row = (DVec4::from_array(rows[3]) - DVec4::W).abs().max_element() <= RIGID_TOLERANCE;
        if off > RIGID_TOLERANCE || axes.determinant() < 0.0 || !is_last_row {
            let value = format!("no rotation (determinant {:.4}, axes off by {off:.4})", axes.determinant());
            let allowed = "rigid: a rotation, a translation and the row 0 0 0 1";
            return Err(self.out_of_range(MATRIX, value, allowed));
        }
        Ok((DQuat::from_mat3(&axes).normalize(), eye_in_source))
    }

    fn rows(&self) -> Result<[[f64; 4]; 4], CameraFileError> {
        let allowed = "4 rows of 4 numbers";
        let given = self.own.get(MATRIX).or_else(|| self.own.get("camera_to_world"));
        let given = given.ok_or_else(|| self.fault(MATRIX, CameraFault::Missing))?;
        let given = matrix_rows(given).ok_or_else(|| self.out_of_range(MATRIX, "of another form", allowed))?;
        let count = Some(given.len()).filter(|count| !(3..=4).contains(count));
        if let Some(wrong) = count.or_else(|| given.iter().map(Vec::len).find(|length| *length != 4)) {
            return Err(self.out_of_range(MATRIX, format!("of {wrong} rows or columns"), allowed));
        }
        // The last row may be left out.
        let mut rows = [[0.0, 0.0, 0.0, 1.0]; 4];
        for (number, value) in rows.iter_mut().flatten().zip(given.iter().flatten()) {
            *number = finite(value).map_err(|kind| self.fault(MATRIX, kind))?;
        }
        Ok(rows)
    }
}

fn focal_length_px(angle_rad: f64, side_px: u32) -> f64 {
    0.5 * f64::from(side_px) / (0.5 * angle_rad).tan()
}

/// The rows of a matrix that is written as rows or as 16 numbers.
fn matrix_rows(value: &Value) -> Option<Vec<Vec<Value>>> {
    let given = value.as_array()?;
    if given.len() == 16 {
        return Some(given.chunks(4).map(<[Value]>::to_vec).collect());
    }
    given.iter().map(|row| row.as_array().cloned()).collect()
}

fn finite(value: &Value) -> Result<f64, CameraFault> {
    value.as_f64().filter(|v| v.is_finite()).ok_or_else(|| {
        CameraFault::NotFinite(if value.is_null() { "null, NaN or infinite".to_owned() } else { value.to_string() })
    })
}
