//! Opacity maps, which become the alpha of colours.

use glam::UVec2;

use super::map::Channel;
use crate::error::{Fault, at_most};
use crate::{Limits, Texture};

/// A texture of a material: numbers of decoded files, at least one of which is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct MaskedTexture {
    pub color: Option<u32>,
    pub mask: Option<u32>,
    /// The mask's channel that is opacity.
    pub channel: Option<Channel>,
}

/// The textures of `used`, in that order.
pub(super) fn masked(
    mut decoded: Vec<Texture>,
    used: &[MaskedTexture],
    limits: &Limits,
) -> Result<Vec<Texture>, Fault> {
    let mut bytes = 0u64;
    let mut textures: Vec<Option<Texture>> = Vec::new();
    for &MaskedTexture { color, mask, channel } in used {
        let color = color.map(|color| &decoded[color as usize]);
        let texture = mask.map(|mask| {
            let mask = &decoded[mask as usize];
            let size_px = color.map_or(UVec2::ONE, size_px).max(size_px(mask));
            bytes += u64::from(size_px.x) * u64::from(size_px.y) * 4;
            at_most("map_d, textures with opacity in bytes", bytes, limits.texture_bytes)?;
            Ok(combined(color, mask, channel, size_px))
        });
        textures.push(texture.transpose()?);
    }
    // Colours without a mask are needed once, and moved.
    for (texture, used) in textures.iter_mut().zip(used) {
        if let (None, Some(color)) = (&texture, used.color) {
            let empty = Texture { width_px: 0, height_px: 0, is_srgb: true, srgba8: Vec::new() };
            *texture = Some(std::mem::replace(&mut decoded[color as usize], empty));
        }
    }
    Ok(textures.into_iter().flatten().collect())
}

fn size_px(texture: &Texture) -> UVec2 {
    UVec2::new(texture.width_px, texture.height_px)
}

/// Colours, white without a texture, with the mask's channel as alpha. Each texel takes the nearest one of both.
fn combined(color: Option<&Texture>, mask: &Texture, channel: Option<Channel>, size_px: UVec2) -> Texture {
    let has_alpha = mask.srgba8.chunks_exact(4).any(|texel| texel[3] < 255);
    let channel = channel.unwrap_or(if has_alpha { Channel::Alpha } else { Channel::Luminance });
    let mut srgba8 = Vec::with_capacity(size_px.x as usize * size_px.y as usize * 4);
    for y in 0..size_px.y {
        for x in 0..size_px.x {
            let at_px = UVec2::new(x, y);
            let [r, g, b, _] = color.map_or([255; 4], |color| nearest(color, at_px, size_px));
            srgba8.extend([r, g, b, opacity(nearest(mask, at_px, size_px), channel)]);
        }
    }
    Texture { width_px: size_px.x, height_px: size_px.y, is_srgb: true, srgba8 }
}

/// The texel at a place among `of_px` columns and rows that stand for the whole texture.
fn nearest(texture: &Texture, at_px: UVec2, of_px: UVec2) -> [u8; 4] {
    let texel = at_px.as_u64vec2() * size_px(texture).as_u64vec2() / of_px.as_u64vec2();
    let first = (texel.y * u64::from(texture.width_px) + texel.x) as usize * 4;
    texture.srgba8.get(first..first + 4).and_then(|texel| texel.try_into().ok()).unwrap_or([255; 4])
}

fn opacity([r, g, b, a]: [u8; 4], channel: Channel) -> u8 {
    match channel {
        Channel::Red => r,
        Channel::Green => g,
        Channel::Blue => b,
        Channel::Alpha => a,
        // Rec. 709.
        Channel::Luminance => (0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b) + 0.5) as u8,
    }
}
