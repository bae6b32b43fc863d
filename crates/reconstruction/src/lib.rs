//! Reconstruction methods: depth images to views.
//!
//! [`Reconstructor::upload`] puts one complete sample set on the device with a min-max pyramid a camera.
//! [`Reconstructor::reconstruct`] draws views from it, many in one submission: tile starts, then the method, the fill and
//! highlights for each position within the pixels, and their mean. [`CommonSets`] are further sets, in which rays off mirrors are followed,
//! and pixels that images leave unknown; or those of the blocks of a scene. Each method is one enum variant, one `.rs` and `.wgsl` pair in `methods`, and has a scalar twin.

mod antialias;
mod blocks;
mod bounce;
mod cube;
mod device;
mod error;
mod fill;
mod in_flight;
#[cfg(test)]
mod layout_tests;
mod lobes;
mod methods;
mod pixel_list;
mod pyramid;
mod quads;
mod ray_ends;
mod reconstructor;
mod recording;
mod reflectors;
mod sample_set;
pub mod scalar;
mod set_description;
mod shaders;
mod single_pole;
mod specular;
mod surface;
mod tile_start;
mod view_work;

pub use bounce::{CurvedSearch, MirrorCell, Mirrors};
pub use error::ReconstructionError;
pub use methods::{METHODS, ReconstructionMethod, UnknownMethod};
pub use pyramid::CodedDepth;
pub use quads::{ErrorBound, MeshStatistics, Quad};
pub use ray_ends::{RayEnd, RayWork};
pub use reconstructor::{CommonSets, DepthQuads, ReconstructRequest, Reconstructor};
pub use sample_set::SampleSet;
pub use set_description::SetDescription;
pub use shaders::{shader_sources, shaders, templates};
pub use view_work::MAX_SAMPLE_CAMERAS;
