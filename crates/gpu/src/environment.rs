//! An environment map on the device: `environment.wgsl` reads it.

use std::sync::Arc;

use depth_image::{EnvironmentLight, EnvironmentMap};
use wgpu::TextureFormat;

use crate::{Binding, Gpu, GpuError, Table, texture_bytes};

const TABLES: [&str; 3] = ["environment_texels", "environment_lobes", "bright_texels"];

/// The map, its means over lobes, and its bright texels.
pub struct GpuEnvironment {
    /// One for each of the variables [`TABLES`].
    tables: [Table; 3],
    /// Bright texels are traced like a lamp.
    pub has_bright_texels: bool,
}

impl GpuEnvironment {
    /// Puts a map on the device.
    ///
    /// # Errors
    /// When a table would exceed the device's limits: names it.
    pub fn upload(gpu: &Arc<Gpu>, map: &EnvironmentMap) -> Result<Self, GpuError> {
        let light = EnvironmentLight::of(map);
        let size_px = map.size_px();
        let count = light.bright_texels.len() as u32;
        let floats = [light.bright_irradiance, light.base_limit].map(f32::to_bits);
        let header = [count, floats[0], floats[1], size_px.x | size_px.y << 16];
        let listed = light.bright_texels.iter().map(|&texel| bytemuck::cast(texel));
        let words: Vec<[u32; 4]> = std::iter::once(header).chain(listed).collect();
        Ok(Self {
            tables: [
                Table::new(gpu, "environment texels", TextureFormat::R32Uint, map.texels_rgb9e5())?,
                Table::new(gpu, "environment lobes", TextureFormat::Rgba32Float, &light.lobes)?,
                Table::new(gpu, "bright texels", TextureFormat::Rgba32Uint, &words)?,
            ],
            has_bright_texels: count > 0,
        })
    }

    /// The resources of `environment.wgsl`.
    #[must_use]
    pub fn bindings(&self) -> [Binding<'_>; 3] {
        std::array::from_fn(|number| Binding::texture(TABLES[number], &self.tables[number]))
    }

    /// The bytes of its tables.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.tables.iter().map(|table| texture_bytes(table.texture())).sum()
    }
}
