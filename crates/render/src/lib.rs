//! Finished pictures of triangles: what sampling and direct rendering share.
//!
//! [`GpuScene`] holds a scene on the device. A [`Renderer`] makes views of it ([`Renderer::draw_views`], the method
//! `direct`) or depth images ([`Renderer::draw_depth_images`]) in three steps, recorded together: which surface each
//! pixel shows, by drawing triangles or by rays ([`Visibility`]); the light that arrives there ([`Lighting`]), by
//! rays where it is to be finer; and the planes that are asked for.

mod accumulation;
mod binding;
mod cluster;
mod data_texture;
mod form;
mod gpu_scene;
mod illuminate;
mod known;
#[cfg(test)]
mod layout_tests;
mod lighting;
mod memory_pass;
mod pixel_camera;
mod planes;
mod raster;
mod rays;
mod renderer;
pub mod scalar;
mod surfaces;
mod texture;
mod visibility;

pub use form::{Domain, Form, Pass, Shading, ShadowRays, shader_text};
pub use gpu_scene::GpuScene;
pub use known::{Asks, LeaveOut, Settled, view_cell_m};
pub use lighting::{Direct, Lighting, MAX_RAYS, Occlusion, Rate, UnknownLighting};
pub use memory_pass::MemoryPass;
pub use rays::AccelerationReport;
pub use renderer::{DrawWork, Refinement, Renderer, SamplePlanes, Visits};
pub use visibility::{Choice, UnknownVisibility, Visibility};

/// Rays of light begin above their surface by this share of the pixel's footprint on it.
pub(crate) const BIAS_FOOTPRINTS: f32 = 0.015_625;

/// The shader templates of this crate.
pub const SHADERS: &[(&str, &str)] = &[
    ("raster.wgsl", include_str!("raster.wgsl")),
    ("surface.wgsl", include_str!("surface.wgsl")),
    ("albedo.wgsl", include_str!("albedo.wgsl")),
    ("camera.wgsl", include_str!("camera.wgsl")),
    ("sequence.wgsl", include_str!("sequence.wgsl")),
    ("sums.wgsl", include_str!("sums.wgsl")),
    ("illuminate.wgsl", include_str!("illuminate.wgsl")),
    ("interpolate.wgsl", include_str!("interpolate.wgsl")),
    ("finish.wgsl", include_str!("finish.wgsl")),
    ("known.wgsl", include_str!("known.wgsl")),
    ("keep.wgsl", include_str!("keep.wgsl")),
    ("footprint.wgsl", include_str!("footprint.wgsl")),
    ("useful.wgsl", include_str!("useful.wgsl")),
    ("rays/traverse.wgsl", include_str!("rays/traverse.wgsl")),
    ("rays/material.wgsl", include_str!("rays/material.wgsl")),
    ("rays/primary.wgsl", include_str!("rays/primary.wgsl")),
];

/// What can go wrong in drawing.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The device's fault or limit.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    /// A shader that cannot be written out.
    #[error(transparent)]
    Template(#[from] gpu::ShaderError),
    /// A camera that cannot be drawn with.
    #[error("camera {index}: {source}")]
    Camera {
        /// Its place in the request.
        index: usize,
        /// What is wrong with it.
        source: depth_image::CameraError,
    },
}
