//! The sampler's service: images are pulled, sampled once and kept for whoever comes next.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod kept;
mod service;

pub use service::SamplerService;
