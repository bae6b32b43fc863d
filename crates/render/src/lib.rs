//! Triangles on the GPU: what sampling and direct rendering share.
//!
//! [`GpuScene`] holds a scene on the device, cut into clusters that are culled per camera;
//! [`Rasterizer`] draws it, as finished views ([`Rasterizer::draw_views`], the method `direct`) or as
//! depth images ([`Rasterizer::draw_depth_images`]).

mod cluster;
mod gpu_scene;
#[cfg(test)]
mod layout_tests;
mod lighting;
mod raster;
pub mod scalar;
mod targets;
mod texture;

pub use gpu_scene::GpuScene;
pub use lighting::Lighting;
pub use raster::{DrawWork, Rasterizer, SamplePlanes};

/// The shader templates of this crate, for validation.
pub const SHADERS: &[(&str, &str)] = &[("raster.wgsl", include_str!("raster.wgsl"))];

/// What can go wrong in drawing.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The device's fault or limit.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    /// A shader that cannot be written out.
    #[error(transparent)]
    Template(#[from] gpu::TemplateError),
    /// A camera that cannot be drawn with.
    #[error("camera {index}: {source}")]
    Camera {
        /// Its place in the request.
        index: usize,
        /// What is wrong with it.
        source: depth_image::CameraError,
    },
}
