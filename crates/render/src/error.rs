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
    /// Light by samples needs images of what its lamps see; light by cube, the cube.
    #[error("lighting {lighting} needs samples of what its lamps see, and there are none")]
    LampSamples { lighting: String },
    /// Shadow maps cannot be drawn from samples.
    #[error("shadow maps of a lamp: {reason}")]
    LampMaps { reason: String },
    /// A sample image cannot be used as light.
    #[error("sample image {index}: {reason}")]
    Samples { index: usize, reason: String },
}
