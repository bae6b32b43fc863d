//! The wgpu device, WGSL templates, frames of passes, read-back and timing.
