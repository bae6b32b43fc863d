//! Textures with mip chains averaged in linear light.

use std::collections::HashMap;

use depth_image::{linear_from_srgb8, srgb8_from_linear};
use gpu::Gpu;
use scene::{Texture, Wrap};
use wgpu::util::{DeviceExt as _, TextureDataOrder};

/// One texel of white, for materials without a texture.
pub(crate) fn white() -> Texture {
    Texture { width_px: 1, height_px: 1, is_srgb: true, srgba8: vec![255; 4] }
}

/// The samplers of all wrap modes.
pub(crate) fn samplers(gpu: &Gpu) -> HashMap<[Wrap; 2], wgpu::Sampler> {
    let mode = |wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
    };
    let all = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    let pairs = all.into_iter().flat_map(|u| all.map(|v| [u, v]));
    pairs.map(|wrap| (wrap, gpu.texture_sampler(wrap.map(mode)))).collect()
}

/// Uploads a texture and all of its mip levels.
pub(crate) fn upload(gpu: &Gpu, texture: &Texture) -> wgpu::TextureView {
    let size = wgpu::Extent3d { width: texture.width_px, height: texture.height_px, depth_or_array_layers: 1 };
    let descriptor = wgpu::TextureDescriptor {
        label: Some("material texture"),
        size,
        mip_level_count: size.max_mips(wgpu::TextureDimension::D2),
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: if texture.is_srgb { wgpu::TextureFormat::Rgba8UnormSrgb } else { wgpu::TextureFormat::Rgba8Unorm },
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let texels: Vec<u8> = mips(texture).flat_map(|level| level.srgba8).collect();
    let texture = gpu.device.create_texture_with_data(&gpu.queue, &descriptor, TextureDataOrder::MipMajor, &texels);
    texture.create_view(&Default::default())
}

/// The texture and its halves, down to one texel.
pub(crate) fn mips(texture: &Texture) -> impl Iterator<Item = Texture> {
    let next = |level: &Texture| (level.width_px.max(level.height_px) > 1).then(|| halved(level));
    std::iter::successors(Some(texture.clone()), next)
}

/// Half the size, each texel the mean of up to four; of colours in linear light.
fn halved(texture: &Texture) -> Texture {
    let (width, height) = ((texture.width_px / 2).max(1), (texture.height_px / 2).max(1));
    let decode: [f32; 256] = std::array::from_fn(|code| linear_from_srgb8(code as u8));
    let texel = |x: u32, y: u32, channel: u32| {
        let (x, y) = (x.min(texture.width_px - 1), y.min(texture.height_px - 1));
        texture.srgba8[((y * texture.width_px + x) * 4 + channel) as usize]
    };
    let mean = |x: u32, y: u32, channel: u32| {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| texel(2 * x + i, 2 * y + j, channel));
        match channel {
            0..3 if texture.is_srgb => srgb8_from_linear(four.iter().map(|&v| decode[v as usize]).sum::<f32>() * 0.25),
            _ => (four.iter().map(|&v| u32::from(v)).sum::<u32>() / 4) as u8,
        }
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let srgba8 = pixels.flat_map(|(x, y)| (0..4).map(move |c| (x, y, c))).map(|(x, y, c)| mean(x, y, c)).collect();
    Texture { width_px: width, height_px: height, is_srgb: texture.is_srgb, srgba8 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halved_textures_average_linear_light() {
        let mut texture = Texture { width_px: 2, height_px: 1, is_srgb: true, srgba8: vec![255; 8] };
        texture.srgba8[..3].fill(0);
        assert_eq!(halved(&texture).srgba8, [188, 188, 188, 255]);
    }
}
