//! MTL material libraries.

use std::collections::HashMap;

use glam::Vec3;

use super::super::clamped::{all_clamped, clamped};
use super::super::folder::{Folder, existing};
use super::super::picture::{Content, EncodedPicture, decode_all};
use super::super::source_scene::SourceScene;
use super::text::{Line, floats, lines};
use crate::error::{Fault, at_most};
use crate::{Limits, Material, TextureUse};

/// Fills the scene's materials and textures, and numbers them for `names`. Missing libraries are skipped;
/// files outside the folder are refused.
pub(super) fn read_materials(
    libraries: &[String],
    names: &[String],
    folder: &Folder,
    limits: &Limits,
    scene: &mut SourceScene,
) -> Result<Vec<u32>, Fault> {
    at_most("materials", names.len() as u64, limits.attributes)?;
    let mut known = HashMap::new();
    for library in libraries {
        let element = format!("mtllib {library}");
        if let Some(bytes) = existing(folder.read_name(&element, library))? {
            parse(&String::from_utf8_lossy(&bytes), &element, limits, &mut known)?;
        }
    }
    let mut textures = Textures::default();
    let mut numbers = Vec::new();
    for name in names {
        let Entry { mut material, picture } = known.get(name).cloned().unwrap_or_default();
        material.name.clone_from(name);
        if material.phong_specular == 0.0 {
            // A material without a highlight; many programs write an exponent all the same.
            material.roughness = 1.0;
        }
        material.base_color_texture =
            picture.map(|file| textures.number_of(&file, folder)).transpose()?.map(TextureUse::from);
        numbers.push(scene.materials.len() as u32);
        scene.materials.push(material);
    }
    if scene.materials.is_empty() {
        scene.materials.push(Material::default());
    }
    scene.textures = decode_all(&textures.encoded, limits, folder.missing_textures)?;
    Ok(numbers)
}

#[derive(Clone, Default)]
struct Entry {
    material: Material,
    picture: Option<String>,
}

fn parse(text: &str, element: &str, limits: &Limits, known: &mut HashMap<String, Entry>) -> Result<(), Fault> {
    let (mut name, mut entry) = (None, Entry::default());
    for line in lines(text) {
        if line.keyword == "newmtl" {
            known.extend(name.replace(line.rest.to_owned()).map(|name| (name, std::mem::take(&mut entry))));
            at_most(element, known.len() as u64, limits.attributes)?;
        } else {
            entry.read_line(&line)?;
        }
    }
    known.extend(name.map(|name| (name, entry)));
    Ok(())
}

impl Entry {
    fn read_line(&mut self, line: &Line) -> Result<(), Fault> {
        let material = &mut self.material;
        match line.keyword {
            "Kd" => {
                let [r, g, b] = color(line)?.to_array();
                material.base_color_linear = [r, g, b, material.base_color_linear[3]];
            }
            "Ks" => material.phong_specular = color(line)?.element_sum() / 3.0,
            "Ke" => material.emissive_linear = color(line)?,
            "Ns" => {
                material.phong_exponent = non_negative(line)?;
                material.roughness = Material::roughness_from_phong_exponent(material.phong_exponent);
            }
            "d" => material.set_opacity(non_negative(line)?),
            "Tr" => material.set_opacity(1.0 - non_negative(line)?),
            "map_Kd" => self.picture = Some(file_name(line.rest).to_owned()),
            _ => {}
        }
        Ok(())
    }
}

impl Material {
    /// Opacity acts as glTF's blending: its share of the surface remains.
    fn set_opacity(&mut self, opacity: f32) {
        self.base_color_linear[3] = opacity.clamp(0.0, 1.0);
        self.alpha_hashed = opacity < 1.0;
    }
}

/// A colour of one or three numbers. Exporters disagree on their encoding; they count as linear, as in the glTF
/// converters. Negative numbers are black.
fn color(line: &Line) -> Result<Vec3, Fault> {
    if line.rest.starts_with("spectral") || line.rest.starts_with("xyz") {
        return Err(Fault::unsupported(line, "colours other than RGB"));
    }
    let is_grey = line.rest.split_ascii_whitespace().count() == 1;
    let [r, g, b] = floats::<3>(line, 1)?.map(|c| c as f32);
    let color = if is_grey { [r; 3] } else { [r, g, b] };
    all_clamped(line, color, 0.0..=f32::MAX).map(Vec3::from)
}

fn non_negative(line: &Line) -> Result<f32, Fault> {
    let [value] = floats::<1>(line, 1)?;
    clamped(line, value as f32, 0.0..=f32::MAX)
}

/// The name follows options such as `-s 1 1 1`; without options it may contain spaces.
fn file_name(rest: &str) -> &str {
    if rest.starts_with('-') { rest.split_ascii_whitespace().next_back().unwrap_or(rest) } else { rest }
}

#[derive(Default)]
struct Textures {
    number_of_file: HashMap<String, u32>,
    encoded: Vec<EncodedPicture>,
}

impl Textures {
    fn number_of(&mut self, file: &str, folder: &Folder) -> Result<u32, Fault> {
        if let Some(&number) = self.number_of_file.get(file) {
            return Ok(number);
        }
        let element = format!("map_Kd {file}");
        let bytes = existing(folder.read_name(&element, file))?;
        let number = self.encoded.len() as u32;
        self.encoded.push(EncodedPicture { element, file: file.to_owned(), bytes, content: Content::Colors });
        self.number_of_file.insert(file.to_owned(), number);
        Ok(number)
    }
}
