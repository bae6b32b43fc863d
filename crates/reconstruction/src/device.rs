//! The device, and buffers that it lends.

use std::sync::Arc;

use gpu::{BufferPool, Gpu};

/// The device, and buffers that it lends.
pub(crate) struct Device {
    pub gpu: Arc<Gpu>,
    pub buffers: BufferPool,
}
