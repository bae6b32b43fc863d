//! Sampling without redundance on the software device.

mod failures;
mod non_redundant;
mod slices;
mod stage;
