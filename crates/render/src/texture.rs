//! Textures with mip chains averaged in linear light.

use std::borrow::Cow;
use std::collections::HashMap;

use depth_image::{linear_from_srgb8, srgb8_from_linear};
use gpu::Gpu;
use scene::{Texture, Wrap};
use wgpu::util::{DeviceExt as _, TextureDataOrder};

/// The samplers of all wrap modes.
pub(crate) fn samplers(gpu: &Gpu) -> HashMap<[Wrap; 2], wgpu::Sampler> {
    let all = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    let pairs = all.into_iter().flat_map(|u| all.map(|v| [u, v]));
    let samplers = pairs.map(|wraps| {
        let modes = wraps.map(|wrap| match wrap {
            Wrap::Repeat => wgpu::AddressMode::Repeat,
            Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
            Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        });
        (wraps, gpu.texture_sampler(modes))
    });
    samplers.collect()
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

/// A scene's textures, whose mip chains take at most `most_texels` together. Where they take more, the largest lose their
/// finest level first, with a warning that names each and the size that is left.
pub(crate) fn within(textures: &[Texture], most_texels: u64) -> Vec<Cow<'_, Texture>> {
    let levels = finest_levels(textures, most_texels);
    let shown = textures.iter().zip(levels).enumerate().map(|(number, (texture, level))| {
        if level == 0 {
            return Cow::Borrowed(texture);
        }
        let [width, height] = size_at(texture, level);
        tracing::warn!("texture {number} is shown at {width}×{height}: the device's table holds {most_texels} texels");
        mips(texture).nth(level as usize).map_or(Cow::Borrowed(texture), Cow::Owned)
    });
    shown.collect()
}

/// The finest level of each texture's mip chain that there is room for.
fn finest_levels(textures: &[Texture], most_texels: u64) -> Vec<u32> {
    let mut levels = vec![0; textures.len()];
    let chains = textures.iter().map(|texture| {
        let areas = (0..32).map(|level| texels_at(texture, level));
        areas.take_while(|&texels| texels > 1).sum::<u64>() + 1
    });
    let mut texels: u64 = chains.sum();
    while texels > most_texels {
        let areas = textures.iter().zip(&levels).map(|(texture, &level)| texels_at(texture, level));
        let Some((largest, area)) = areas.enumerate().rev().max_by_key(|&(_, area)| area) else { break };
        if area <= 1 {
            break;
        }
        texels -= area;
        levels[largest] += 1;
    }
    levels
}

fn texels_at(texture: &Texture, level: u32) -> u64 {
    size_at(texture, level).map(u64::from).iter().product()
}

/// The sides of a level of a mip chain in texels, 1 at least.
fn size_at(texture: &Texture, level: u32) -> [u32; 2] {
    [texture.width_px, texture.height_px].map(|side| (side >> level).max(1))
}

/// The texture and its halves, down to one texel.
pub(crate) fn mips(texture: &Texture) -> impl Iterator<Item = Texture> {
    std::iter::successors(Some(texture.clone()), |level| {
        (level.width_px.max(level.height_px) > 1).then(|| halved(level))
    })
}

/// Half the size, each texel the mean of up to four; of colours in linear light.
fn halved(texture: &Texture) -> Texture {
    let width = (texture.width_px / 2).max(1);
    let height = (texture.height_px / 2).max(1);
    let decode: [f32; 256] = std::array::from_fn(|code| linear_from_srgb8(code as u8));
    let mut srgba8 = Vec::with_capacity((4 * width * height) as usize);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let x = (2 * x + i).min(texture.width_px - 1);
            let y = (2 * y + j).min(texture.height_px - 1);
            4 * (y * texture.width_px + x) as usize
        });
        for channel in 0..4 {
            let four = four.map(|first| texture.srgba8[first + channel]);
            srgba8.push(match channel {
                0..3 if texture.is_srgb => {
                    srgb8_from_linear(four.iter().map(|&v| decode[v as usize]).sum::<f32>() * 0.25)
                }
                _ => (four.iter().map(|&v| u32::from(v)).sum::<u32>() / 4) as u8,
            });
        }
    }
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

    #[test]
    fn the_largest_textures_lose_levels_where_all_are_too_many() {
        let texture = |width_px, height_px| {
            let srgba8 = vec![9; 4 * (width_px * height_px) as usize];
            Texture { width_px, height_px, is_srgb: false, srgba8 }
        };
        let textures = [texture(8, 8), texture(16, 4), texture(2, 2)];
        // 64 + 16 + 4 + 1, 64 + 16 + 4 + 2 + 1 and 4 + 1 texels.
        let taken = |most_texels| -> Vec<[u32; 2]> {
            let within = within(&textures, most_texels);
            assert!(within.iter().all(|t| t.srgba8.len() == 4 * (t.width_px * t.height_px) as usize));
            within.iter().map(|t| [t.width_px, t.height_px]).collect()
        };
        assert_eq!(taken(177), [[8, 8], [16, 4], [2, 2]]);
        assert_eq!(taken(176), [[4, 4], [16, 4], [2, 2]]);
        assert_eq!(taken(112), [[4, 4], [8, 2], [2, 2]]);
        assert_eq!(taken(0), [[1, 1], [1, 1], [1, 1]]);
        let all: usize = within(&textures, 177).iter().flat_map(|t| mips(t)).map(|level| level.srgba8.len() / 4).sum();
        assert_eq!(all, 177);
    }
}
