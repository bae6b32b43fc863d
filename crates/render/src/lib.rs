//! Finished pictures of triangles: what sampling and direct rendering share.
//!
//! [`GpuScene`] holds a scene on the device. A [`Renderer`] makes views of it ([`Renderer::draw_views`], the method
//! `direct`) or depth images ([`Renderer::draw_depth_images`]) in stages that are recorded together (`stages.rs`): the surface
//! that each pixel shows, by drawing triangles or by rays ([`Visibility`]); the light that arrives there ([`Lighting`]), by
//! rays where it is to be finer; what mirrors show, in views; and the planes that are asked for. Each pass is a file pair, and its variant says which
//! switches its shader has.

mod accumulation;
mod batch;
mod cluster;
mod coverage;
mod error;
mod few_cores;
mod finish;
mod gpu_scene;
mod grid;
mod illuminate;
mod keep;
mod known_samples;
mod lamp_bits;
mod lamp_maps;
mod lamp_shares;
mod layered;
mod layers;
#[cfg(test)]
mod layout_tests;
mod light_cache;
mod light_samples;
mod lighting;
mod material;
mod motion;
mod pieces;
mod pixel_camera;
mod pixel_list;
mod planes;
mod raster;
mod rays;
mod redundancy_test;
mod reflections;
mod renderer;
pub mod scalar;
mod shaders;
mod smooth_light;
mod stages;
mod sums;
mod surfaces;
mod texture;
mod visibility;
mod work;

pub use depth_image::Refinement;
pub use error::RenderError;
pub use gpu_scene::GpuScene;
pub use lamp_maps::{LampMapSource, LampMaps};
pub use light_samples::LightCache;
pub use lighting::{Ambient, Direct, GridVisibility, Lighting, MAX_GRID_SIDE, MAX_RAYS, UnknownLighting};
pub use rays::AccelerationReport;
pub use redundancy_test::{Evidence, RedundancyTest};
pub use renderer::Renderer;
pub use shaders::{SHADERS, shader_sources, templates};
pub use visibility::{Choice, UnknownVisibility, Visibility};
pub use work::{DrawWork, LayerSelection, SamplePlanes};
