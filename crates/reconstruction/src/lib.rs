//! Reconstruction methods: depth images to views.
//!
//! [`Reconstructor::upload`] puts one complete sample set on the device with a min-max pyramid a camera;
//! [`Reconstructor::reconstruct`] draws views from it, many in one submission. Each method is one enum
//! variant, one `.rs` and `.wgsl` pair, and has a scalar twin.

mod error_bound;
mod layout;
#[cfg(test)]
mod layout_tests;
mod methods;
mod pyramid;
mod quad_drawing;
mod quads;
mod reconstructor;
mod reflectors;
mod required_planes;
mod sample_set;
pub mod scalar;
mod shaders;
mod word_texture;

pub use error_bound::ErrorBound;
pub use methods::{METHODS, ReconstructionMethod, UnknownMethod};
pub use pyramid::{CodedDepth, Pyramid};
pub use quads::{MeshStatistics, Quad};
pub use reconstructor::{Reconstructor, Statistics};
pub use required_planes::RequiredPlanes;
pub use sample_set::{MAX_SAMPLE_CAMERAS, SampleSet, SetDescription};
pub use shaders::{SHADERS, ShaderKey, shader_text};

/// Why views cannot be reconstructed.
#[derive(Debug, thiserror::Error)]
pub enum ReconstructionError {
    /// The device's fault or limit.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    /// A shader that cannot be written out.
    #[error(transparent)]
    Template(#[from] gpu::ShaderError),
    /// A camera that cannot be used.
    #[error("view camera {index}: {source}")]
    Camera {
        /// Its place in the request.
        index: usize,
        /// What is wrong with it.
        source: depth_image::CameraError,
    },
    /// A sample image that cannot be used.
    #[error("sample image {index}: {reason}")]
    Sample {
        /// Its place in the set.
        index: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A sample image without a plane that the method needs.
    #[error("sample image {index} has no plane {plane}, which hybrid_mesh needs")]
    MissingPlane {
        /// Its place in the set.
        index: usize,
        /// As [`depth_image::DepthImageError`] calls it.
        plane: &'static str,
    },
    /// Too many or too few images.
    #[error("a sample set holds 1 to {MAX_SAMPLE_CAMERAS} images, not {0}")]
    SampleCount(usize),
    /// No volume to search.
    #[error("the volume of the sample set is empty or not finite")]
    Volume,
}
