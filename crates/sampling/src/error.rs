//! Errors of sampling.

/// Why samples could not be taken.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum SamplingError {
    /// A camera, the device, or a shader.
    #[error(transparent)]
    Render(#[from] render::RenderError),
    /// Layers are peeled from one place.
    #[error("camera {index} is another than the first: all layers are taken by one camera")]
    Layer { index: usize },
    /// A cube has lines, and no cameras of views.
    #[error("{method} samples along the lines of a cube, which these sample cameras are not")]
    Lines { method: String },
    /// The lines of a cube are sampled by another method.
    #[error("{method} samples with the cameras of views, and not along the lines of a cube")]
    Cameras { method: String },
    /// A texel has several positions, whose colours count, but one light.
    #[error("{method} samples several positions a texel, and samples of light have one")]
    Positions { method: String },
    /// A selected image is not in the set, or images in sequence are not all selected.
    #[error("image {index} is not among the {cameras} of the set, or not wanted with all others by {method}")]
    Selection { index: u32, cameras: usize, method: String },
}
