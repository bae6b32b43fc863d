//! Errors of camera files.

use depth_image::CameraError;

/// A camera file that cannot be used, with the place of the fault.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}: {kind}")]
pub struct CameraFileError {
    /// The path of the file.
    pub file: String,
    /// `frame 3, fl_x`, or the part outside frames.
    pub place: String,
    /// The reason.
    #[source]
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
    /// The camera as a whole is not valid.
    #[error(transparent)]
    Camera(#[from] CameraError),
}
