//! The sampler's service: images are sampled on the first request and cached for the next.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod encoded_set_cache;
mod service;

pub use service::SamplerService;
