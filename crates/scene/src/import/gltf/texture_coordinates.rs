//! The texture coordinates of a material's textures: their set and `KHR_texture_transform`.
//!
//! Transforms are baked into vertices, and a vertex has room for two pairs of coordinates.

use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::Material as JsonMaterial;
use gltf::json::texture::{Info, Texture as JsonTexture};
use gltf::json::{Index, Value};

use super::parsed;
use super::specular_glossiness::SpecularGlossiness;
use crate::Fault;

const TRANSFORM: &str = "KHR_texture_transform";

/// A set of texture coordinates and their transform.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct UvSource {
    pub set: u32,
    transform: Option<Transform>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Transform {
    offset: [f32; 2],
    scale: [f32; 2],
    rotation_rad: f32,
}

impl UvSource {
    fn of(set: u32, transform: Option<&TextureTransform>) -> Self {
        let Some(TextureTransform { offset, scale, rotation, tex_coord, .. }) = transform else {
            return Self { set, transform: None };
        };
        let transform = Transform { offset: offset.0, scale: scale.0, rotation_rad: rotation.0 };
        Self { set: tex_coord.unwrap_or(set), transform: Some(transform) }
    }

    /// Scale, then rotate counter-clockwise as seen with v downwards, then offset.
    pub(super) fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let Some(Transform { offset, scale, rotation_rad }) = self.transform else { return [u, v] };
        let (sin, cos) = rotation_rad.sin_cos();
        let u = u * scale[0];
        let v = v * scale[1];
        [cos * u + sin * v + offset[0], cos * v - sin * u + offset[1]]
    }
}

/// A texture of a material.
#[derive(Clone, Copy)]
pub(super) struct Map {
    pub texture: Index<JsonTexture>,
    pub source: UvSource,
}

impl Map {
    fn of(info: &Info) -> Self {
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        Self { texture: info.index, source: UvSource::of(info.tex_coord, transform) }
    }

    /// A texture whose extensions the `gltf` crate leaves unparsed.
    fn unparsed(
        texture: Index<JsonTexture>,
        set: u32,
        transform: Option<&Value>,
        element: &str,
    ) -> Result<Self, Fault> {
        let element = format_args!("{element}: {TRANSFORM}");
        let transform: Option<TextureTransform> = transform.map(|value| parsed(value, element)).transpose()?;
        Ok(Self { texture, source: UvSource::of(set, transform.as_ref()) })
    }
}

/// The textures of a material in the order of [`crate::Material::textures`].
pub(super) fn maps_of(
    material: &JsonMaterial,
    specular_glossiness: Option<&SpecularGlossiness>,
    element: &str,
) -> Result<[Option<Map>; 5], Fault> {
    let pbr = &material.pbr_metallic_roughness;
    let normal = material.normal_texture.as_ref().map(|t| {
        let transform = t.extensions.as_ref().and_then(|e| e.others.get(TRANSFORM));
        Map::unparsed(t.index, t.tex_coord, transform, element)
    });
    let occlusion = material.occlusion_texture.as_ref().map(|t| {
        let transform = t.extensions.as_ref().and_then(|e| e.others.get(TRANSFORM));
        Map::unparsed(t.index, t.tex_coord, transform, element)
    });
    let base_color = match specular_glossiness {
        Some(specular_glossiness) => specular_glossiness.diffuse_texture.as_ref(),
        None => pbr.base_color_texture.as_ref(),
    };
    Ok([
        base_color.map(Map::of),
        pbr.metallic_roughness_texture.as_ref().map(Map::of),
        normal.transpose()?,
        material.emissive_texture.as_ref().map(Map::of),
        occlusion.transpose()?,
    ])
}

/// The coordinates that a material's vertices have.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Coordinates {
    pub first: UvSource,
    pub second: Option<UvSource>,
    /// Set where there is a normal map: whether it lies on the second pair.
    pub tangents_along_second: Option<bool>,
}

impl Coordinates {
    /// The first two kinds that occur.
    pub(super) fn of(maps: &[Option<Map>; 5]) -> Self {
        let mut sources = maps.iter().flatten().map(|map| map.source);
        let first = sources.next().unwrap_or_default();
        let second = sources.find(|source| *source != first);
        let mut coordinates = Self { first, second, tangents_along_second: None };
        coordinates.tangents_along_second = maps[2].and_then(|normal| coordinates.is_second(&normal.source));
        coordinates
    }

    /// Whether these coordinates are the second pair; `None` where vertices have no room for them.
    pub(super) fn is_second(&self, source: &UvSource) -> Option<bool> {
        let is_second = self.second.as_ref() == Some(source);
        (is_second || self.first == *source).then_some(is_second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_maps_u_to_minus_v() {
        let transform = Transform { offset: [1.0, 2.0], scale: [2.0, 1.0], rotation_rad: std::f32::consts::FRAC_PI_2 };
        let [u, v] = UvSource { set: 0, transform: Some(transform) }.apply([0.5, 0.0]);
        assert!((u - 1.0).abs() < 1e-6 && (v - 1.0).abs() < 1e-6, "{u} {v}");
    }

    #[test]
    fn vertices_have_room_for_two_kinds_of_coordinates() {
        let map = |set| Some(Map { texture: Index::new(0), source: UvSource { set, transform: None } });
        let coordinates = Coordinates::of(&[map(1), map(1), map(0), map(2), None]);
        let is_second = |set| coordinates.is_second(&UvSource { set, transform: None });
        assert_eq!([is_second(1), is_second(0), is_second(2)], [Some(false), Some(true), None]);
        assert_eq!(coordinates.tangents_along_second, Some(true));
        assert_eq!(Coordinates::of(&[None; 5]), Coordinates::default());
    }
}
