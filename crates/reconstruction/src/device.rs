//! The device, with the buffers that it lends and the passes that are built on it.

use std::sync::Arc;

use gpu::{BufferPool, Gpu, GpuError, PassCache, PooledBuffer};

/// The device, with the buffers that it lends and the passes that are built on it.
pub(crate) struct Device {
    pub gpu: Arc<Gpu>,
    pub buffers: BufferPool,
    pub passes: PassCache,
}

impl Device {
    /// Lends a storage buffer of this size.
    ///
    /// # Errors
    /// More than the device binds.
    pub fn lend(&self, label: &'static str, bytes: usize) -> Result<PooledBuffer, GpuError> {
        self.gpu.check_storage_bytes(label, bytes as u64)?;
        Ok(self.buffers.lend_storage(label, bytes as u64))
    }
}
