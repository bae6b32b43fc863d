//! Why views cannot be reconstructed.

use depth_image::{MAX_MIRROR_CELLS, MAX_REFLECTIONS};

use crate::view_work::MAX_SAMPLE_CAMERAS;

/// Why views cannot be reconstructed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum ReconstructionError {
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    #[error(transparent)]
    Shader(#[from] gpu::ShaderError),
    /// A camera of a view is invalid; `index` is its place in the request.
    #[error("view camera {index}: {source}")]
    Camera { index: usize, source: depth_image::CameraError },
    /// A sample image is invalid; `index` is its place in the set.
    #[error("sample image {index}: {reason}")]
    Sample { index: usize, reason: String },
    #[error("the light field: {reason}")]
    LightField { reason: String },
    /// A sample image lacks a plane, named as in [`depth_image::SampleImageError`].
    #[error("sample image {index} has no plane {plane}, which the reconstruction method needs")]
    MissingPlane { index: usize, plane: &'static str },
    /// The method, or rays off mirrors, show the colour of samples; `index` is the image's place in the set.
    #[error("sample image {index} has light where colour is needed")]
    LightForColor { index: usize },
    #[error("a sample set holds 1 to {MAX_SAMPLE_CAMERAS} images, not {0}")]
    SampleCount(usize),
    #[error("views have at most {MAX_MIRROR_CELLS} mirror cells, not {0}")]
    MirrorCells(usize),
    #[error("rays meet at most {MAX_REFLECTIONS} mirrors, not {0}")]
    Reflections(u32),
    /// Views are reconstructed from pinhole images; others show what mirrors do.
    #[error("images of {model} cameras are followed by mirrored rays alone")]
    Model { model: &'static str },
    #[error(
        "steps of {coarse_px} and {fine_px} texels: fine ones are 0.0625 at least, coarse ones as long or longer, up to 64"
    )]
    CurvedSearch { coarse_px: f32, fine_px: f32 },
    /// The set has other samples than a method, or rays off mirrors, need.
    #[error("{what} needs {needed}, which the sample set lacks")]
    NoSamples { what: String, needed: &'static str },
    /// The method takes surfaces from the scene, which this crate does not have.
    #[error("{method} takes surfaces from the scene, and cannot be reconstructed from samples alone")]
    NoScene { method: String },
    /// Views from the blocks of a scene are searched along rays, in images alone.
    #[error("views from blocks of a scene follow rays in images alone, without {what}")]
    Blocks { what: String },
    #[error("the volume of the sample set is empty or not finite")]
    Volume,
}

impl ReconstructionError {
    /// The sample image with this place in the set is invalid.
    pub(crate) fn sample(index: usize, reason: impl ToString) -> Self {
        Self::Sample { index, reason: reason.to_string() }
    }
}
