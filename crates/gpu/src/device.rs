//! Finding and opening a device.

use std::{fmt, str::FromStr, sync::Arc};

use crate::error::GpuError;

/// The adapters to choose from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DevicePreference {
    /// A GPU if there is one, else the software device.
    #[default]
    Any,
    /// The software device even beside a GPU.
    Software,
}

impl FromStr for DevicePreference {
    type Err = GpuError;
    fn from_str(text: &str) -> Result<Self, GpuError> {
        match text {
            "any" => Ok(Self::Any),
            "software" => Ok(Self::Software),
            other => Err(GpuError::UnknownPreference(other.to_owned())),
        }
    }
}

impl fmt::Display for DevicePreference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Any => "any",
            Self::Software => "software",
        })
    }
}

/// An open device. One is shared by everything in a process.
pub struct Gpu {
    /// Makes resources.
    pub device: wgpu::Device,
    /// Takes work.
    pub queue: wgpu::Queue,
    /// Name, backend and kind.
    pub info: wgpu::AdapterInfo,
    pub(crate) timestamp_period_ns: Option<f32>,
}

impl Gpu {
    /// Opens the preferred device with all of its limits.
    ///
    /// # Errors
    /// No device exists, or it cannot be opened.
    pub fn open(preference: DevicePreference) -> Result<Arc<Self>, GpuError> {
        pollster::block_on(Self::open_async(preference))
    }

    async fn open_async(preference: DevicePreference) -> Result<Arc<Self>, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                force_fallback_adapter: preference == DevicePreference::Software,
                ..Default::default()
            })
            .await
            .map_err(|error| GpuError::NoDevice(error.to_string()))?;
        let info = adapter.get_info();
        let wanted = wgpu::Features::TIMESTAMP_QUERY
            | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS
            | wgpu::Features::PRIMITIVE_INDEX;
        let features = adapter.features() & wanted;
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("myriorama"),
                required_features: features,
                required_limits: adapter.limits(),
                memory_hints: wgpu::MemoryHints::MemoryUsage,
                ..Default::default()
            })
            .await
            .map_err(|error| GpuError::Open { name: info.name.clone(), reason: error.to_string() })?;
        let has_timestamps =
            features.contains(wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);
        // On a processor, wall clock around submit and wait is right; its time stamps are not.
        let timestamp_period_ns =
            (has_timestamps && info.device_type != wgpu::DeviceType::Cpu).then(|| queue.get_timestamp_period());
        tracing::info!(device = info.name, backend = %info.backend, "graphics device opened");
        Ok(Arc::new(Self { device, queue, info, timestamp_period_ns }))
    }

    /// The name of the device in reports.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{} ({}, {})", self.info.name, self.info.backend, self.info.driver_info)
    }

    /// Whether shaders run on the processor.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Whether fragment shaders know their triangle's number.
    #[must_use]
    pub fn has_primitive_index(&self) -> bool {
        self.device.features().contains(wgpu::Features::PRIMITIVE_INDEX)
    }

    /// Checks a storage buffer's size against the device, before it is made.
    ///
    /// # Errors
    /// Names the buffer, its size and the limit.
    pub fn check_storage_bytes(&self, what: &str, bytes: u64) -> Result<(), GpuError> {
        let limits = self.device.limits();
        GpuError::check_limit(what, bytes, limits.max_storage_buffer_binding_size.min(limits.max_buffer_size))
    }

    /// A buffer with contents.
    #[must_use]
    pub fn buffer_with<T: bytemuck::NoUninit>(
        &self,
        label: &str,
        contents: &[T],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            // A binding may not be empty.
            size: (bytes.len().next_multiple_of(4) as u64).max(16),
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if bytes.len().is_multiple_of(4) {
            self.queue.write_buffer(&buffer, 0, bytes);
        } else {
            let mut padded = bytes.to_vec();
            padded.resize(bytes.len().next_multiple_of(4), 0);
            self.queue.write_buffer(&buffer, 0, &padded);
        }
        buffer
    }
}
