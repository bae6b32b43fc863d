//! The sampler's service: images are sampled on the first request and cached for the next.

mod service;

pub use service::SamplerService;
