//! Buffers that live longer than one frame: making and zeroing them each time costs more than many passes.

use std::{
    collections::HashMap,
    ops::Deref,
    sync::{Arc, Mutex, PoisonError, Weak},
};

use crate::Gpu;

type Key = (u64, wgpu::BufferUsages);
type Free = Mutex<HashMap<Key, Vec<wgpu::Buffer>>>;

/// Lends buffers of sizes rounded up to a power of two; they come back when dropped.
pub struct BufferPool {
    gpu: Arc<Gpu>,
    free: Arc<Free>,
}

/// A buffer on loan; contents are whatever the last borrower left.
pub struct PooledBuffer {
    buffer: Option<wgpu::Buffer>,
    key: Key,
    home: Weak<Free>,
}

impl BufferPool {
    /// An empty pool.
    #[must_use]
    pub fn new(gpu: &Arc<Gpu>) -> Self {
        Self { gpu: gpu.clone(), free: Arc::default() }
    }

    /// A buffer of at least `bytes`.
    #[must_use]
    pub fn lend(&self, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> PooledBuffer {
        let key = (bytes.max(256).next_power_of_two().min(bytes.max(256).next_multiple_of(1 << 22)), usage);
        let kept = self.free.lock().unwrap_or_else(PoisonError::into_inner).get_mut(&key).and_then(Vec::pop);
        let buffer = kept.unwrap_or_else(|| {
            self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: key.0,
                usage,
                mapped_at_creation: false,
            })
        });
        PooledBuffer { buffer: Some(buffer), key, home: Arc::downgrade(&self.free) }
    }

    /// A device buffer that shaders write and copies read.
    #[must_use]
    pub fn lend_storage(&self, label: &str, bytes: u64) -> PooledBuffer {
        self.lend(
            label,
            bytes,
            wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        )
    }

    /// A host-visible buffer to read back into.
    #[must_use]
    pub fn lend_host(&self, label: &str, bytes: u64) -> PooledBuffer {
        self.lend(label, bytes, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST)
    }
}

impl Deref for PooledBuffer {
    type Target = wgpu::Buffer;
    fn deref(&self) -> &wgpu::Buffer {
        self.buffer.as_ref().expect("present until dropped")
    }
}

impl Drop for PooledBuffer {
    fn drop(&mut self) {
        if let (Some(home), Some(buffer)) = (self.home.upgrade(), self.buffer.take()) {
            home.lock().unwrap_or_else(PoisonError::into_inner).entry(self.key).or_default().push(buffer);
        }
    }
}
