//! Errors of drawing.

/// A fault of the device, a shader or a camera.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum RenderError {
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    #[error(transparent)]
    Shader(#[from] gpu::ShaderError),
    /// A camera of the request is invalid.
    #[error("camera {index}: {source}")]
    Camera { index: usize, source: depth_image::CameraError },
    /// Some pictures are taken by pinholes alone.
    #[error("camera {index} is a {model}, must be a pinhole for {what}")]
    Model { index: usize, model: &'static str, what: &'static str },
    /// A sample image cannot be used as light.
    #[error("sample image {index}: {reason}")]
    Samples { index: usize, reason: String },
}
