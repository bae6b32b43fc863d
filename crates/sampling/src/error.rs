//! Errors of sampling.

/// Why samples could not be taken.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum SamplingError {
    /// A camera, the device, or a shader.
    #[error(transparent)]
    Render(#[from] render::RenderError),
    /// Layers are peeled from one place.
    #[error("camera {index}: the layers of depth_peeling are taken by one camera, this is another")]
    Layer { index: usize },
    /// An image that is not there, or images of a sequence without the others.
    #[error("image {index} is not among the {cameras} of the set, or not wanted with all others by {method}")]
    Wanted { index: u32, cameras: usize, method: String },
}
