//! Materials.

use glam::{Vec3, Vec4};
use gltf::json::material::{AlphaMode, Material as JsonMaterial};
use gltf::json::validation::Checked;

use super::super::SourceScene;
use super::super::picture::decode_all;
use super::Document;
use super::specular_glossiness::SpecularGlossiness;
use super::texture_coordinates::Coordinates;
use super::textures::{
    BASE_COLOR, EMISSIVE, METALLIC_ROUGHNESS, Means, NORMAL, OCCLUSION, Pictures, Uses, number_shown,
};
use crate::{DEFAULT_IOR, DIELECTRIC_REFLECTANCE, Fault, MAX_IOR, Material, Volume, reflectance_of_ior};

/// Fills the scene's materials, one more than the file's (its default), and its textures. Returns the coordinates that the
/// vertices of each material have.
pub(super) fn read(document: &Document, scene: &mut SourceScene) -> Result<Vec<Coordinates>, Fault> {
    let materials = &document.root.materials;
    let mut pictures = Pictures::new(document);
    let mut uses = Vec::with_capacity(materials.len());
    for (number, material) in materials.iter().enumerate() {
        uses.push(Uses::of(material, &mut pictures, &format!("material {number}"))?);
    }
    let encoded = pictures.encoded()?;
    let mut textures = decode_all(&encoded, document.limits, document.missing_textures)?;
    let is_shown = number_shown(&mut uses, textures.len());
    let means = &Means::of(&textures);
    for (number, (material, uses)) in materials.iter().zip(&uses).enumerate() {
        let reader = MaterialReader { material, uses, means, element: format!("material {number}") };
        scene.materials.push(reader.material()?);
    }
    scene.materials.push(Material { name: "default".into(), ..Material::default() });
    let mut is_shown = is_shown.into_iter();
    textures.retain(|_| is_shown.next() == Some(true));
    scene.textures = textures;
    Ok(uses.iter().map(|uses| uses.coordinates).chain([Coordinates::default()]).collect())
}

/// A material of the file with its textures.
struct MaterialReader<'a> {
    material: &'a JsonMaterial,
    uses: &'a Uses,
    means: &'a Means<'a>,
    /// The material in messages.
    element: String,
}

/// What light a surface scatters and reflects.
struct Surface {
    base_color: [f32; 4],
    /// At normal incidence, where the surface is no metal.
    reflectance: Vec3,
    /// Metallic, then roughness.
    factors: [f32; 2],
    /// Factors times the texture's mean.
    mean_factors: [f32; 2],
}

/// What a surface lets through.
struct Transmission {
    share: f32,
    ior: f32,
    volume: Option<Volume>,
}

impl MaterialReader<'_> {
    fn material(self) -> Result<Material, Fault> {
        let Self { material, uses, element, .. } = &self;
        let Checked::Valid(alpha_mode) = material.alpha_mode else {
            return Err(Fault::malformed(element, "unknown alphaMode"));
        };
        let Surface { base_color, reflectance, factors, mean_factors } = match &uses.specular_glossiness {
            Some(json) => self.specular_glossiness_surface(json)?,
            None => self.metallic_roughness_surface()?,
        };
        let [metallic, roughness] = mean_factors;
        let mean_reflectance = reflectance.element_sum() / 3.0;
        let (phong_specular, phong_exponent) =
            Material::phong_from_metallic_roughness(metallic, roughness, mean_reflectance);
        let Transmission { share: transmission, ior, volume } = self.transmission()?;
        let scale = material.normal_texture.as_ref().map_or(1.0, |t| t.scale);
        let strength = material.occlusion_texture.as_ref().map_or(1.0, |t| t.strength.0);
        for (map, name) in [(NORMAL, "normal map"), (OCCLUSION, "occlusion texture")] {
            if uses.without_coordinates(map).is_some() {
                tracing::warn!("{element}: its {name} needs a third pair of texture coordinates and is left out");
            }
        }
        Ok(Material {
            base_color_linear: base_color,
            base_color_texture: uses.texture(BASE_COLOR),
            metallic: factors[0],
            roughness: factors[1],
            metallic_roughness_texture: uses.texture(METALLIC_ROUGHNESS),
            dielectric_reflectance_linear: reflectance,
            normal_texture: uses.texture(NORMAL),
            normal_scale: self.finite("normal scale", scale)?,
            occlusion_texture: uses.texture(OCCLUSION),
            occlusion_strength: self.clamped("occlusion strength", strength, 1.0)?,
            emissive_linear: self.emissive()?,
            emissive_texture: uses.texture(EMISSIVE),
            phong_specular,
            phong_exponent,
            alpha_cutoff: match alpha_mode {
                AlphaMode::Mask => {
                    self.clamped("alpha cutoff", material.alpha_cutoff.map_or(0.5, |c| c.0), f32::MAX)?
                }
                AlphaMode::Opaque | AlphaMode::Blend => 0.0,
            },
            alpha_hashed: alpha_mode == AlphaMode::Blend,
            double_sided: material.double_sided,
            unlit: material.extensions.as_ref().is_some_and(|e| e.unlit.is_some()),
            transmission,
            ior,
            volume,
            name: material.name.clone().unwrap_or(self.element),
        })
    }

    fn metallic_roughness_surface(&self) -> Result<Surface, Fault> {
        let pbr = &self.material.pbr_metallic_roughness;
        let base_color = self.all_clamped("base colour", pbr.base_color_factor.0, 1.0)?;
        let reflectance = self.dielectric_reflectance()?;
        let metallic = self.clamped("metallic", pbr.metallic_factor.0, 1.0)?;
        let roughness = self.clamped("roughness", pbr.roughness_factor.0, 1.0)?;
        let place = self.uses.place(METALLIC_ROUGHNESS);
        let of_texture = place.map_or(Vec4::ONE, |place| self.means.linear(place));
        let mean_factors = [metallic * of_texture.z, roughness * of_texture.y];
        let is_mean = self.uses.without_coordinates(METALLIC_ROUGHNESS).is_some();
        let factors = if is_mean { mean_factors } else { [metallic, roughness] };
        Ok(Surface { base_color, reflectance, factors, mean_factors })
    }

    fn specular_glossiness_surface(&self, json: &SpecularGlossiness) -> Result<Surface, Fault> {
        let [r, g, b, alpha] = self.all_clamped("diffuse colour", json.diffuse_factor.unwrap_or([1.0; 4]), 1.0)?;
        let specular = self.all_clamped("specular colour", json.specular_factor.unwrap_or([1.0; 3]), 1.0)?;
        let glossiness = self.clamped("glossiness", json.glossiness_factor.unwrap_or(1.0), 1.0)?;
        let of_texture = self.uses.specular_glossiness_texture.map_or(Vec4::ONE, |place| self.means.linear(place));
        let reflectance = Vec3::from(specular) * of_texture.truncate();
        let factors = [0.0, 1.0 - glossiness * of_texture.w];
        // What is reflected is not scattered.
        let scattered = 1.0 - reflectance.max_element();
        let base_color = [r * scattered, g * scattered, b * scattered, alpha];
        Ok(Surface { base_color, reflectance, factors, mean_factors: factors })
    }

    /// The reflectance of `KHR_materials_ior` and `KHR_materials_specular` at normal incidence. Their textures count by
    /// their mean.
    fn dielectric_reflectance(&self) -> Result<Vec3, Fault> {
        let Self { uses, means, .. } = self;
        let extensions = self.material.extensions.as_ref();
        let ior = extensions.and_then(|e| e.ior.as_ref());
        let from_ior = match ior.map(|ior| self.clamped("ior", ior.ior.0, f32::MAX)).transpose()? {
            None => DIELECTRIC_REFLECTANCE,
            // The extension's text: 0 stands for an infinite index.
            Some(0.0) => 1.0,
            Some(ior) => reflectance_of_ior(ior.max(1.0)),
        };
        let Some(specular) = extensions.and_then(|e| e.specular.as_ref()) else { return Ok(Vec3::splat(from_ior)) };
        let factor = self.clamped("specular", specular.specular_factor.0, 1.0)?;
        let color = Vec3::from(self.all_clamped("specular colour", specular.specular_color_factor.0, f32::MAX)?);
        let factor = factor * uses.specular.map_or(1.0, |place| means.linear(place).w);
        let color = color * uses.specular_color.map_or(Vec3::ONE, |place| means.linear(place).truncate());
        Ok((color * from_ior).min(Vec3::ONE) * factor)
    }

    /// `KHR_materials_transmission`, with the refractive index and the volume that only transmissive surfaces have. The texture
    /// counts by its mean.
    fn transmission(&self) -> Result<Transmission, Fault> {
        let opaque = Transmission { share: 0.0, ior: DEFAULT_IOR, volume: None };
        let Some(extensions) = &self.material.extensions else { return Ok(opaque) };
        let Some(json) = &extensions.transmission else { return Ok(opaque) };
        let factor = self.clamped("transmission", json.transmission_factor.0, 1.0)?;
        let share = factor * self.uses.transmission.map_or(1.0, |place| self.means.linear(place).x);
        if share == 0.0 {
            return Ok(opaque);
        }
        let ior = self.finite("ior", extensions.ior.as_ref().map_or(DEFAULT_IOR, |ior| ior.ior.0))?;
        if !(1.0..=MAX_IOR).contains(&ior) {
            let reason = format!("{ior} is not from 1 to {MAX_IOR}, as of a surface that light goes through");
            return Err(Fault::malformed(format_args!("{}: ior", self.element), reason));
        }
        Ok(Transmission { share, ior, volume: self.volume()? })
    }

    /// `KHR_materials_volume`; `None` for a surface without thickness. Rays measure the thickness themselves.
    fn volume(&self) -> Result<Option<Volume>, Fault> {
        let json = self.material.extensions.as_ref().and_then(|e| e.volume.as_ref());
        let Some(json) = json else { return Ok(None) };
        if self.not_negative("thickness", json.thickness_factor.0)? == 0.0 {
            return Ok(None);
        }
        let color = self.all_clamped("attenuation colour", json.attenuation_color.0, 1.0)?;
        let distance = self.not_negative("attenuation distance", json.attenuation_distance.0)?;
        if distance == 0.0 {
            tracing::warn!("{}: an attenuation distance of 0 counts as none", self.element);
        }
        Ok(Some(Volume {
            attenuation_color_linear: color.into(),
            attenuation_distance_m: if distance == 0.0 { f32::INFINITY } else { distance },
        }))
    }

    fn not_negative(&self, name: &str, value: f32) -> Result<f32, Fault> {
        if value >= 0.0 {
            Ok(value)
        } else {
            Err(Fault::malformed(format_args!("{}: {name}", self.element), format!("{value} is negative or no number")))
        }
    }

    fn emissive(&self) -> Result<Vec3, Fault> {
        let extensions = self.material.extensions.as_ref();
        let strength = extensions.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |s| s.emissive_strength.0);
        let place = self.uses.without_coordinates(EMISSIVE);
        let mean = place.map_or(Vec3::ONE, |place| self.means.linear(place).truncate());
        let color = (Vec3::from(self.material.emissive_factor.0) * mean * strength).to_array();
        self.all_clamped("emissive colour", color, f32::MAX).map(Vec3::from)
    }

    fn finite(&self, name: &str, value: f32) -> Result<f32, Fault> {
        if value.is_finite() {
            Ok(value)
        } else {
            Err(Fault::malformed(format_args!("{}: {name}", self.element), "not finite"))
        }
    }

    /// Clamps a finite value to 0 and `most`: a colour of −0.01 or a roughness of 1.5 is an exporter's rounding and no
    /// reason to refuse a model.
    fn clamped(&self, name: &str, value: f32, most: f32) -> Result<f32, Fault> {
        let within = self.finite(name, value)?.clamp(0.0, most);
        if within != value {
            tracing::warn!("{}: {name}: {value} is out of range, {within} is taken", self.element);
        }
        Ok(within)
    }

    fn all_clamped<const N: usize>(&self, name: &str, mut values: [f32; N], most: f32) -> Result<[f32; N], Fault> {
        for value in &mut values {
            *value = self.clamped(name, *value, most)?;
        }
        Ok(values)
    }
}
