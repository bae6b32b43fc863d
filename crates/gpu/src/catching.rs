//! Work on a device whose faults are caught: they end the work with an error, not the process.

use std::sync::atomic::Ordering;

use crate::{device::Gpu, error::GpuError, frame::notice_loss};

impl Gpu {
    /// Does work on the device, all of it on this thread. Where the device runs out of memory, the work fails with
    /// [`GpuError::OutOfMemory`], whatever it made of that; free buffers are then released. Where the device is lost, it
    /// fails with [`GpuError::Lost`].
    ///
    /// # Errors
    /// The work's own, or these.
    pub fn catching<T, E: From<GpuError>>(&self, work: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        self.faults.check_lost()?;
        let filters = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::OutOfMemory];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let done = work();
        // The last scope is popped first.
        let caught = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop()));
        let caught: Vec<wgpu::Error> = caught.collect();
        match caught.first() {
            // Of several, the shortage is the first to be popped; the others follow from it.
            Some(wgpu::Error::OutOfMemory { source }) => {
                self.faults.run_short();
                return Err(GpuError::OutOfMemory(source.to_string()).into());
            }
            Some(_) => notice_loss(self),
            None => (),
        }
        self.faults.check_lost()?;
        caught.first().map_or(done, |refused| Err(GpuError::Refused(refused.to_string()).into()))
    }

    /// Whether the device is lost for all work.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        notice_loss(self);
        self.faults.check_lost().is_err()
    }

    /// Times that the device's memory ran out. What was made before may be without memory.
    #[must_use]
    pub fn shortages(&self) -> u64 {
        self.faults.shortages()
    }

    /// For tests: the next frame that is submitted runs out of memory.
    pub fn inject_out_of_memory(&self) {
        self.faults.injected.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{BufferPool, DevicePreference, Frame, Turn};

    fn open() -> Arc<Gpu> {
        Gpu::open(DevicePreference::Software).expect("a software device")
    }

    /// Copies words through the device.
    fn copied(gpu: &Gpu, pool: &BufferPool) -> Result<Vec<u32>, GpuError> {
        let source = gpu.buffer_with("words", &[7_u32; 64], wgpu::BufferUsages::COPY_SRC);
        let mut frame = Frame::begin(gpu, "copy", Turn::default());
        let read = frame.read_back(&source, 0..256, pool.lend_host("words", 256));
        frame.submit()?.wait()?.with(read, <[u32]>::to_vec)
    }

    #[test]
    fn work_that_runs_out_of_memory_fails_alone() {
        let gpu = open();
        let pool = BufferPool::new(&gpu);
        gpu.inject_out_of_memory();
        let failed = gpu.catching(|| copied(&gpu, &pool));
        assert!(matches!(failed, Err(GpuError::OutOfMemory(_))), "{failed:?}");
        let next: Result<_, GpuError> = gpu.catching(|| copied(&gpu, &pool));
        assert_eq!((next.expect("words"), gpu.shortages()), (vec![7; 64], 1));
    }

    #[test]
    fn a_buffer_that_the_device_cannot_hold_is_an_error_and_not_lent_again() {
        let gpu = open();
        let pool = BufferPool::new(&gpu);
        let most = gpu.device.limits().max_buffer_size;
        let mut held = Vec::new();
        let filled: Result<(), GpuError> = gpu.catching(|| {
            held.push(pool.lend_storage("beyond all limits", most + (1 << 23)));
            Ok(())
        });
        assert!(matches!(filled, Err(GpuError::OutOfMemory(_) | GpuError::Refused(_))), "{filled:?}");
        let next: Result<_, GpuError> = gpu.catching(|| copied(&gpu, &pool));
        assert_eq!(next.expect("words").len(), 64);
    }

    #[test]
    fn work_on_a_lost_device_fails_as_lost_and_does_not_panic() {
        let gpu = open();
        let pool = BufferPool::new(&gpu);
        gpu.device.destroy();
        for _ in 0..2 {
            let failed = gpu.catching(|| copied(&gpu, &pool));
            assert!(matches!(failed, Err(GpuError::Lost(_))), "{failed:?}");
        }
        assert!(gpu.is_lost() && !open().is_lost());
    }
}
