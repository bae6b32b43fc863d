//! Words of materials that draws and rays share.

use depth_image::Reflector;
use glam::Vec3;
use scene::Material;

/// The word of a surface's highlight under Blinn-Phong.
pub(crate) fn phong_reflector(material: &Material) -> u32 {
    if material.phong_specular <= 0.0 {
        return 0;
    }
    let roughness = Reflector::roughness_of_exponent(material.phong_exponent);
    Reflector { reflectance_linear: Vec3::splat(material.phong_specular), roughness }.pack()
}

/// The scale of a material's normal map, 0 where it has none: shaders then read a texel of white.
pub(crate) fn normal_scale(material: &Material) -> f32 {
    material.normal_texture.map_or(0.0, |_| material.normal_scale)
}
