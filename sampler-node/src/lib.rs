//! The sampler's service.
