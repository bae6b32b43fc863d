//! Sampling methods (scene to depth images) and sample-camera rigs.

mod method;
mod rig;
mod sampler;

pub use method::{SamplingMethod, UnknownSampling};
pub use rig::{Rig, RigError};
pub use sampler::{SampleWork, Sampler, SamplingError};
