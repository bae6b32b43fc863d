//! Finding and opening a device.

use std::{fmt, str::FromStr, sync::Arc};

use parking_lot::Mutex;

use crate::error::GpuError;
use crate::faults::Faults;
use crate::sharing::DeviceQueue;

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
        let preferences = [Self::Any, Self::Software];
        let named = preferences.into_iter().find(|preference| preference.to_string() == text);
        named.ok_or_else(|| GpuError::UnknownPreference(text.to_owned()))
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

/// The shaders that were compiled on a second device, so that other work on this one does not wait (`shader/warming.rs`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CompiledOutside {
    /// Shaders with a form of their resources.
    pub compiled: u64,
    /// Those that this device had to compile after all.
    pub failed: u64,
}

/// An open device. One is shared by everything in a process.
pub struct Gpu {
    /// Makes resources.
    pub device: wgpu::Device,
    /// Takes work.
    pub queue: wgpu::Queue,
    /// Name, backend and kind.
    pub info: wgpu::AdapterInfo,
    /// The order of all work on this device.
    pub device_queue: Arc<DeviceQueue>,
    pub(crate) faults: Arc<Faults>,
    pub(crate) timestamp_period_ns: Option<f32>,
    pub(crate) compiled_outside: Mutex<CompiledOutside>,
}

impl Gpu {
    /// Opens the preferred device with all of its limits.
    ///
    /// # Errors
    /// No device exists, or it cannot be opened.
    pub fn open(preference: DevicePreference) -> Result<Arc<Self>, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        // Sizes of indirect dispatches come from our own lists of pixels. To check each would take a dispatch of its own.
        descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
        let instance = wgpu::Instance::new(descriptor);
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            force_fallback_adapter: preference == DevicePreference::Software,
            ..Default::default()
        }))
        .map_err(|error| GpuError::NoDevice(error.to_string()))?;
        let info = adapter.get_info();
        let timestamps = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        let features = adapter.features() & (timestamps | wgpu::Features::PRIMITIVE_INDEX);
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("myriorama"),
            required_features: features,
            required_limits: adapter.limits(),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..Default::default()
        }))
        .map_err(|error| GpuError::Open { name: info.name.clone(), reason: error.to_string() })?;
        // On a processor, wall clock around submit and wait is right; its time stamps are not.
        let timestamp_period_ns = (features.contains(timestamps) && info.device_type != wgpu::DeviceType::Cpu)
            .then(|| queue.get_timestamp_period());
        tracing::info!(device = info.name, backend = %info.backend, "graphics device opened");
        let faults = Arc::new(Faults::default());
        device.set_device_lost_callback({
            let faults = faults.clone();
            move |cause, reason| {
                faults.lost.lock().get_or_insert(format!("{cause:?}: {reason}"));
            }
        });
        let (device_queue, compiled_outside) = Default::default();
        Ok(Arc::new(Self { device, queue, info, device_queue, faults, timestamp_period_ns, compiled_outside }))
    }

    /// The name of the device in reports.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{} ({}, {})", self.info.name, self.info.backend, self.info.driver_info)
    }

    /// The shaders that were compiled outside this device's queue so far.
    #[must_use]
    pub fn compiled_outside(&self) -> CompiledOutside {
        *self.compiled_outside.lock()
    }

    /// Whether shaders run on the processor.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Checks a storage buffer's size against the device, before it is made.
    ///
    /// # Errors
    /// Names the buffer, its size and the limit.
    pub fn check_storage_bytes(&self, what: &str, bytes: u64) -> Result<(), GpuError> {
        GpuError::check_limit(what, bytes, self.most_storage_bytes())
    }

    /// The bytes of the largest storage buffer that the device can bind.
    #[must_use]
    pub fn most_storage_bytes(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// A buffer of zeros.
    #[must_use]
    pub fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        self.device.create_buffer(&descriptor)
    }

    /// A texture of one level. `size` is columns, rows and layers.
    #[must_use]
    pub fn texture(
        &self,
        label: &str,
        size: [u32; 3],
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> wgpu::Texture {
        let [width, height, depth_or_array_layers] = size;
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    /// A sampler of textures of materials: smooth at every distance; the modes beyond the borders are along u and v.
    #[must_use]
    pub fn texture_sampler(&self, [address_mode_u, address_mode_v]: [wgpu::AddressMode; 2]) -> wgpu::Sampler {
        // The anisotropic filter of Mesa's software device does not mirror.
        let is_mirrored = [address_mode_u, address_mode_v].contains(&wgpu::AddressMode::MirrorRepeat);
        self.device.create_sampler(&wgpu::SamplerDescriptor {
            address_mode_u,
            address_mode_v,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            anisotropy_clamp: if is_mirrored { 1 } else { 4 },
            ..Default::default()
        })
    }

    /// A buffer with contents, a multiple of 4 bytes.
    #[must_use]
    pub fn buffer_with<T: bytemuck::NoUninit>(
        &self,
        label: &str,
        contents: &[T],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        // A binding may not be empty.
        let buffer = self.buffer(label, bytes.len().max(16) as u64, usage | wgpu::BufferUsages::COPY_DST);
        self.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }
}
