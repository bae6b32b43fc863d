//! The device, with the buffers that it lends and the passes that are built on it.

use std::sync::Arc;

use gpu::{BufferPool, Gpu, PassCache};

/// The device, with the buffers that it lends and the passes that are built on it.
pub(crate) struct Device {
    pub gpu: Arc<Gpu>,
    pub buffers: BufferPool,
    pub passes: PassCache,
}
