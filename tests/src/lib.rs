//! Whole-project tests: architecture and clusters on real processes and ports.
//!
//! Here is what they share: a small scalar device and a cluster in one process.

pub mod cluster;
pub mod scalar_engine;
