//! Reading camera files.

use std::path::Path;

use depth_image::{MAX_IMAGE_SIDE_PX, PinholeCamera};
use glam::{DMat3, DQuat, DVec3, UVec2, Vec2};
use serde_json::{Map, Value};

use super::error::{CameraFault, CameraFileError};
use super::placement::Placement;

/// The most bytes of a camera file: a thousand cameras take about 0.5 MB.
pub const MAX_FILE_BYTES: u64 = 32 << 20;
/// The most cameras of a file.
pub const MAX_FRAMES: usize = 65_536;
/// The tolerance of a matrix's axes to unit length and right angles.
const RIGID_TOLERANCE: f64 = 1e-3;
const MODELS: [&str; 3] = ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE"];
const DISTORTIONS: [&str; 8] = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"];

/// A fault and its place, before the file's name is known.
struct Fault {
    place: String,
    kind: CameraFault,
}

impl Fault {
    fn at(place: impl Into<String>, kind: CameraFault) -> Self {
        Self { place: place.into(), kind }
    }
}

/// Reads all cameras of a file.
///
/// # Errors
/// The error names the file, the frame, the field and the reason.
pub fn read(path: &Path, placement: Placement) -> Result<Vec<PinholeCamera>, CameraFileError> {
    let cameras = text_of(path).and_then(|text| parse(&text, placement));
    cameras.map_err(|fault| CameraFileError { file: path.display().to_string(), place: fault.place, kind: fault.kind })
}

fn text_of(path: &Path) -> Result<String, Fault> {
    use std::io::Read as _;
    let io = |error: std::io::Error| Fault::at("file", error.into());
    let file = std::fs::File::open(path).map_err(io)?;
    let mut text = String::new();
    // One byte more than allowed: a pipe has no length to check first.
    file.take(MAX_FILE_BYTES + 1).read_to_string(&mut text).map_err(io)?;
    at_most("file", text.len() as u64, MAX_FILE_BYTES)?;
    Ok(text)
}

fn at_most(place: &str, actual: u64, limit: u64) -> Result<(), Fault> {
    if actual > limit { Err(Fault::at(place, CameraFault::TooLarge { actual, limit })) } else { Ok(()) }
}

fn parse(text: &str, placement: Placement) -> Result<Vec<PinholeCamera>, Fault> {
    let json: Value = serde_json::from_str(&without_nan(text)).map_err(|error| Fault::at("file", error.into()))?;
    let shared = json.as_object().ok_or_else(|| Fault::at("file", CameraFault::Missing))?;
    let frames =
        json.get("frames").and_then(Value::as_array).ok_or_else(|| Fault::at("frames", CameraFault::Missing))?;
    at_most("frames", frames.len() as u64, MAX_FRAMES as u64)?;
    if frames.is_empty() {
        return Err(Fault::at("frames", CameraFault::Missing));
    }
    frames.iter().enumerate().map(|(index, frame)| Frame::of(index, frame, shared)?.camera(placement)).collect()
}

/// Replaces NaN and Infinity, which Python writes and JSON does not have, by `null`: they are reported with frame and
/// field.
fn without_nan(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for (index, part) in text.split('"').enumerate() {
        if index > 0 {
            out.push('"');
        }
        // Strings of camera files hold no escaped quotes.
        if index % 2 == 0 {
            out.push_str(&part.replace("-Infinity", "null").replace("Infinity", "null").replace("NaN", "null"));
        } else {
            out.push_str(part);
        }
    }
    out
}

/// A frame, and the fields that the file has for all frames.
struct Frame<'a> {
    index: usize,
    own: &'a Map<String, Value>,
    shared: &'a Map<String, Value>,
}

impl<'a> Frame<'a> {
    fn of(index: usize, frame: &'a Value, shared: &'a Map<String, Value>) -> Result<Self, Fault> {
        let own = frame.as_object().ok_or_else(|| Fault::at(format!("frame {index}"), CameraFault::Missing))?;
        Ok(Self { index, own, shared })
    }

    fn fault(&self, field: &str, kind: CameraFault) -> Fault {
        Fault::at(format!("frame {}, {field}", self.index), kind)
    }

    fn value(&self, field: &str) -> Option<&'a Value> {
        self.own.get(field).or_else(|| self.shared.get(field))
    }

    fn optional(&self, field: &str) -> Result<Option<f64>, Fault> {
        self.value(field).map(|value| finite(value).map_err(|kind| self.fault(field, kind))).transpose()
    }

    fn number(&self, field: &str) -> Result<f64, Fault> {
        self.optional(field)?.ok_or_else(|| self.fault(field, CameraFault::Missing))
    }

    fn side(&self, field: &str) -> Result<u32, Fault> {
        let side = self.number(field)?;
        let usable = side.fract() == 0.0 && (1.0..=f64::from(MAX_IMAGE_SIDE_PX)).contains(&side);
        let allowed = "a whole number from 1 to 16384";
        if usable {
            Ok(side as u32)
        } else {
            Err(self.fault(field, CameraFault::OutOfRange { value: side.to_string(), allowed }))
        }
    }

    fn check_model(&self) -> Result<(), Fault> {
        let model = self.value("camera_model").and_then(Value::as_str).unwrap_or("OPENCV");
        if !MODELS.contains(&model) {
            return Err(self.fault("camera_model", CameraFault::Unsupported(model.to_owned())));
        }
        for field in DISTORTIONS {
            if let Some(value) = self.optional(field)?.filter(|value| *value != 0.0) {
                return Err(self.fault(field, CameraFault::Unsupported(format!("{field} = {value}"))));
            }
        }
        Ok(())
    }

    fn camera(&self, placement: Placement) -> Result<PinholeCamera, Fault> {
        self.check_model()?;
        let size_px = UVec2::new(self.side("w")?, self.side("h")?);
        let focal_x = self.number("fl_x")?;
        let principal = [
            self.optional("cx")?.unwrap_or(f64::from(size_px.x) / 2.0),
            self.optional("cy")?.unwrap_or(f64::from(size_px.y) / 2.0),
        ];
        let (rotation, eye_in_source) = self.pose()?;
        let camera = PinholeCamera {
            eye_in_world: (eye_in_source - placement.origin_in_source).as_vec3(),
            world_from_camera: rotation.as_quat().normalize(),
            focal_px: Vec2::new(focal_x as f32, self.optional("fl_y")?.unwrap_or(focal_x) as f32),
            principal_px: Vec2::from_array(principal.map(|v| v as f32)),
            size_px,
            near_m: placement.near_m,
        };
        camera.validate().map_err(|error| self.fault("camera", error.into()))?;
        Ok(camera)
    }

    fn pose(&self) -> Result<(DQuat, DVec3), Fault> {
        let rows = self.rows()?;
        let column = |i: usize| DVec3::new(rows[0][i], rows[1][i], rows[2][i]);
        let axes = DMat3::from_cols(column(0), column(1), column(2));
        let off = (axes.transpose() * axes - DMat3::IDENTITY)
            .to_cols_array()
            .into_iter()
            .fold(0.0f64, |most, v| most.max(v.abs()));
        if off > RIGID_TOLERANCE || axes.determinant() < 0.0 || rows[3] != [0.0, 0.0, 0.0, 1.0] {
            let value = format!("no rotation (determinant {:.4}, axes off by {off:.4})", axes.determinant());
            let allowed = "rigid: a rotation, a translation and the row 0 0 0 1";
            return Err(self.fault("transform_matrix", CameraFault::OutOfRange { value, allowed }));
        }
        Ok((DQuat::from_mat3(&axes).normalize(), column(3)))
    }

    fn rows(&self) -> Result<[[f64; 4]; 4], Fault> {
        let missing = || self.fault("transform_matrix", CameraFault::Missing);
        let shape = |given: usize| {
            let allowed = "4 rows of 4 numbers";
            self.fault(
                "transform_matrix",
                CameraFault::OutOfRange { value: format!("of {given} rows or columns"), allowed },
            )
        };
        let given = self.own.get("transform_matrix").and_then(Value::as_array).ok_or_else(missing)?;
        if !(3..=4).contains(&given.len()) {
            return Err(shape(given.len()));
        }
        let mut rows = [[0.0; 4], [0.0; 4], [0.0; 4], [0.0, 0.0, 0.0, 1.0]];
        for (row, values) in rows.iter_mut().zip(given) {
            let values = values.as_array().ok_or_else(missing)?;
            if values.len() != 4 {
                return Err(shape(values.len()));
            }
            for (number, value) in row.iter_mut().zip(values) {
                *number = finite(value).map_err(|kind| self.fault("transform_matrix", kind))?;
            }
        }
        Ok(rows)
    }
}

fn finite(value: &Value) -> Result<f64, CameraFault> {
    let told = || if value.is_null() { "null, NaN or infinite".to_owned() } else { value.to_string() };
    value.as_f64().filter(|v| v.is_finite()).ok_or_else(|| CameraFault::NotFinite(told()))
}
