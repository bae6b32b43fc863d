//! Sampling methods (scene to depth images) and sample-camera rigs.

mod error;
mod impostors;
mod methods;
mod mirrors;
mod rig;
mod sampler;
pub mod scalar;
mod work;

pub use error::SamplingError;
pub use impostors::{Impostors, UnknownImpostors};
pub use methods::{LayeredCube, LightFieldSize, METHODS, Redundancy, SamplingMethod, UnknownSampling, templates};
pub use mirrors::{Mirror, mirrors};
pub use rig::{Rig, RigError};
pub use sampler::{Sampler, renderer};
pub use work::SampleWork;
