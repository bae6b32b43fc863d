//! Reconstruction methods: depth images to views.
//!
//! [`Reconstructor::upload`] puts one complete sample set on the device with a min-max pyramid a camera.
//! [`Reconstructor::reconstruct`] draws views from it, many in one submission: tile starts, the method, the fill and
//! highlights. Each method is one enum variant, one `.rs` and `.wgsl` pair in `methods`, and has a scalar twin.

mod device;
mod error;
mod error_bound;
mod fill;
mod in_flight;
#[cfg(test)]
mod layout_tests;
mod methods;
mod pixel_list;
mod pyramid;
mod quads;
mod reconstructor;
mod recording;
mod reflectors;
mod required_planes;
mod sample_set;
#[cfg(feature = "scalar")]
pub mod scalar;
mod set_description;
mod shaders;
mod specular;
mod surface;
mod tile_start;
mod view_work;

pub use error::ReconstructionError;
pub use error_bound::ErrorBound;
pub use in_flight::Statistics;
pub use methods::{METHODS, ReconstructionMethod, UnknownMethod};
pub use pyramid::{CodedDepth, Pyramid};
pub use quads::{MeshStatistics, Quad};
pub use reconstructor::Reconstructor;
pub use required_planes::RequiredPlanes;
pub use sample_set::SampleSet;
pub use set_description::SetDescription;
pub use shaders::{shader_sources, shaders, templates};
pub use view_work::MAX_SAMPLE_CAMERAS;
