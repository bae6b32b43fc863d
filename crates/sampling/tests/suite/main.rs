//! Sampling on the software device: planes and batches, and images that omit what others hold.

mod coverage;
mod failures;
mod non_redundant;
mod sampler;
mod slices;
mod stage;
