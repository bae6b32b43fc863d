//! Sampling methods (scene to depth images) and sample-camera rigs.

mod depth_peeling;
mod method;
mod non_redundant;
mod rig;
mod sampler;
pub mod scalar;
mod settling;

pub use method::{Redundancy, SamplingMethod, UnknownSampling};
pub use rig::{Rig, RigError};
pub use sampler::{SampleWork, Sampler, SamplingError, renderer};

/// The tests of what images leave out: templates that `render` includes.
#[must_use]
pub fn shaders() -> Vec<(&'static str, &'static str)> {
    [&non_redundant::SHADERS[..], &depth_peeling::SHADERS[..]].concat()
}
