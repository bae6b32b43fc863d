//! The device behind a node: [`node::Engine`] over the drawing, sampling and reconstruction crates.

mod error;
mod gpu_engine;

pub use gpu_engine::GpuEngine;
