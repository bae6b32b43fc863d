//! MTL material libraries.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::super::{Import, Warnings, decoded};
use super::map::TextureMap;
use super::text::{Line, finite, for_each_line, without_byte_order_mark, without_comment};
use crate::{Fault, Material, at_most};

/// Statements that are not read and change little of what is seen: ambient light, the index of refraction, and the filters
/// of reflections and textures.
const HARMLESS: [&str; 5] = ["Ka", "map_Ka", "Ni", "sharpness", "map_aat"];

/// A material as a library has it.
#[derive(Debug, Clone, Default)]
pub(super) struct Entry {
    /// Any bytes, comment included.
    pub name: Vec<u8>,
    /// The library's folder, relative to the scene's folder.
    pub folder: PathBuf,
    pub color_map: Option<TextureMap>,
    pub alpha_map: Option<TextureMap>,
    material: Material,
    /// `d`.
    opacity: Option<f32>,
    /// `Tr`.
    transparency: Option<f32>,
    /// `illum`.
    model: Option<u32>,
}

/// Appends the materials of a library.
pub(super) fn parse(
    bytes: &[u8],
    element: &str,
    folder: &Path,
    import: &Import,
    entries: &mut Vec<Entry>,
) -> Result<(), Fault> {
    let first = entries.len();
    for_each_line(&without_byte_order_mark(bytes), element, |line| {
        if line.is("newmtl") {
            entries.push(Entry { name: line.rest.to_owned(), folder: folder.to_owned(), ..Entry::default() });
            return at_most(element, entries.len() as u64, import.limits.attributes);
        }
        let entry = entries[first..].last_mut();
        if entry.is_some_and(|entry| entry.read_line(line, &import.warnings).is_none()) {
            import.warnings.count("statements of materials without usable numbers are left out", line);
        }
        Ok(())
    })
}

impl Entry {
    /// `None` for a statement without usable numbers.
    fn read_line(&mut self, line: &Line, warnings: &Warnings) -> Option<()> {
        let material = &mut self.material;
        if line.is("Kd") {
            let [r, g, b] = color(line)?.to_array();
            material.base_color_linear = [r, g, b, 1.0];
        } else if line.is("Ks") {
            material.phong_specular = color(line)?.element_sum() / 3.0;
        } else if line.is("Ke") {
            material.emissive_linear = color(line)?;
        } else if line.is("Ns") {
            material.phong_exponent = non_negative(line)?;
            material.roughness = Material::roughness_from_phong_exponent(material.phong_exponent);
        } else if line.is("d") {
            self.opacity = non_negative(line);
            self.opacity?;
        } else if line.is("Tr") {
            self.transparency = non_negative(line);
            self.transparency?;
        } else if line.is("illum") {
            self.model = non_negative(line).map(|model| model as u32);
        } else if line.is("map_Kd") {
            self.color_map = TextureMap::parse(line, warnings).or(self.color_map.take());
        } else if line.is("map_d") || line.is("map_opacity") {
            self.alpha_map = TextureMap::parse(line, warnings).or(self.alpha_map.take());
        } else if !HARMLESS.iter().any(|keyword| line.is(keyword)) {
            warnings.list("statements of materials that are not shown", decoded(line.keyword));
        }
        Some(())
    }

    /// The material without its textures.
    pub(super) fn material(&self, name: String, warnings: &Warnings) -> Material {
        let mut material = Material { name, double_sided: true, ..self.material.clone() };
        // Models 0 and 1 of illumination have no highlight, and an exponent of 0 is one as wide as the hemisphere.
        let has_highlight = self.model.is_none_or(|model| model > 1) && material.phong_exponent >= 1.0;
        if !has_highlight {
            material.phong_specular = 0.0;
        }
        if material.phong_specular == 0.0 {
            // A material without a highlight; many programs write an exponent all the same.
            material.roughness = 1.0;
        }
        let opacity = self.opacity(&material.name, warnings);
        // Opacity acts as glTF's blending: its share of the surface remains.
        material.base_color_linear[3] = opacity;
        material.alpha_hashed = opacity < 1.0;
        material
    }

    /// `d`, or else `Tr`. MeshLab and openMVS write `Tr 1` for an opaque material, where others write `Tr 0`: 1 alone counts as
    /// transparent only where another statement is a sign of it.
    fn opacity(&self, name: &str, warnings: &Warnings) -> f32 {
        let has_glass_model = matches!(self.model, Some(4 | 6 | 7 | 9));
        let opacity = match (self.opacity, self.transparency) {
            (Some(opacity), _) => opacity,
            (None, Some(transparency)) if transparency < 1.0 || self.alpha_map.is_some() || has_glass_model => {
                1.0 - transparency
            }
            (None, Some(_)) => {
                warnings.list("materials with Tr 1 alone count as opaque", name);
                1.0
            }
            (None, None) => 1.0,
        };
        if opacity <= 0.0 {
            warnings.list("materials are invisible by d or Tr", name);
        }
        opacity.clamp(0.0, 1.0)
    }
}

/// The name without comment and quotes, to compare where no name is equal to the byte.
pub(super) fn folded_name(name: &[u8]) -> Vec<u8> {
    let bare = without_comment(name);
    let unquoted = bare.strip_prefix(b"\"").and_then(|inner| inner.strip_suffix(b"\"")).unwrap_or(bare);
    unquoted.to_ascii_lowercase()
}

/// A colour of one or three numbers. Exporters disagree on their encoding; they count as linear, as in the glTF
/// converters. Negative numbers are black.
fn color(line: &Line) -> Option<Vec3> {
    let [r, g, b] = line.numbers();
    let r = r?;
    let color = match [g, b] {
        [Some(g), Some(b)] => [r, g, b],
        _ => [r; 3],
    };
    let color = Vec3::from(color.map(|c| c.max(0.0) as f32));
    (line.numbers::<3>().iter().flatten().all(|c| c.is_finite()) && color.is_finite()).then_some(color)
}

/// The first number; `d -halo` has an option before it.
fn non_negative(line: &Line) -> Option<f32> {
    let number = line.words().find(|word| *word != b"-halo").and_then(finite)?;
    Some(number.max(0.0) as f32).filter(|number| number.is_finite())
}
