//! The numbered elements of a file: positions with colours, texture coordinates, normals.

use glam::DVec3;

use super::super::Import;
use super::super::source_scene::plain_vertex;
use super::super::vertex_colors::{ColorRange, Colors};
use super::super::warnings::Warnings;
use super::text::Line;
use crate::error::{Fault, at_most};
use crate::{Limits, Vertex};

/// The number of an element that a corner does not have.
pub(super) const NONE: u32 = u32::MAX;

/// Positions, coordinates and normals are numbered separately; a vertex is a triple of these numbers.
pub(super) type Corner = [u32; 3];

#[derive(Default)]
pub(super) struct Attributes {
    /// Not finite where the file has no numbers.
    pub positions_in_source: Vec<DVec3>,
    /// One for each position once any position has one.
    colors: Vec<[f32; 4]>,
    /// The colours of ZBrush, in the order of positions.
    mrgb_srgb8: Vec<[u8; 3]>,
    uvs: Vec<[f32; 2]>,
    /// Zero where they must be computed.
    normals: Vec<[f32; 3]>,
}

impl Attributes {
    /// `v x y z`, optionally followed by a weight or a colour, as several programs write it.
    pub(super) fn push_position(&mut self, line: &Line, import: &Import) -> Result<(), Fault> {
        at_most(line, self.positions_in_source.len() as u64 + 1, import.limits.vertices)?;
        let [x, y, z, a, g, b] = line.numbers();
        let position = DVec3::from([x, y, z].map(|c| c.unwrap_or(f64::NAN)));
        if !position.is_finite() {
            import.warnings.count("vertices without three finite coordinates", line);
        }
        if let [Some(r), Some(g), Some(b)] = [a, g, b] {
            self.colors.resize(self.positions_in_source.len(), [f32::NAN; 4]);
            self.colors.push([r, g, b, f64::NAN].map(|c| c as f32));
        }
        let weight = a.filter(|weight| g.is_none() && weight.is_finite() && *weight != 0.0);
        self.positions_in_source.push(weight.map_or(position, |weight| position / weight));
        Ok(())
    }

    pub(super) fn push_uv(&mut self, line: &Line, warnings: &Warnings) {
        let [u, v] = line.numbers();
        // OBJ's v runs upwards.
        let uv = [u, v].map(|c| c.unwrap_or(0.0) as f32);
        if u.is_none() || !uv.iter().all(|c| c.is_finite()) {
            warnings.count("texture coordinates that are not finite count as 0", line);
        }
        let [u, v] = uv.map(|c| if c.is_finite() { c } else { 0.0 });
        self.uvs.push([u, 1.0 - v]);
    }

    pub(super) fn push_normal(&mut self, line: &Line, warnings: &Warnings) {
        let normal = line.numbers::<3>().map(|c| c.unwrap_or(f64::NAN));
        let direction = DVec3::from(normal).try_normalize();
        if direction.is_none() && normal != [0.0; 3] {
            warnings.count("normals that are not finite are computed", line);
        }
        self.normals.push(direction.unwrap_or(DVec3::ZERO).as_vec3().to_array());
    }

    /// `#MRGB` and up to 64 colours of eight digits: a mask, red, green, blue.
    pub(super) fn push_mrgb(&mut self, line: &Line, limits: &Limits) {
        for digits in line.rest.chunks_exact(8) {
            let number = std::str::from_utf8(digits).ok().and_then(|digits| u32::from_str_radix(digits, 16).ok());
            let Some(number) = number.filter(|_| (self.mrgb_srgb8.len() as u64) < limits.vertices) else { return };
            let [_, r, g, b] = number.to_be_bytes();
            self.mrgb_srgb8.push([r, g, b]);
        }
    }

    /// A corner without the parts that are not there.
    pub(super) fn existing(&self, [position, uv, normal]: Corner) -> Corner {
        let uv = if (uv as usize) < self.uvs.len() { uv } else { NONE };
        let normal = if (normal as usize) < self.normals.len() { normal } else { NONE };
        [position, uv, normal]
    }

    /// How many elements of each kind there are so far: negative numbers count back from here.
    pub(super) fn counts(&self) -> [usize; 3] {
        [self.positions_in_source.len(), self.uvs.len(), self.normals.len()]
    }

    /// Colours of all positions, in bytes; shorter where some have none.
    pub(super) fn colors_srgba8(&mut self) -> Vec<[u8; 4]> {
        if self.colors.is_empty() {
            return self.mrgb_srgb8.iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        }
        Colors { range: ColorRange::Floats, values: std::mem::take(&mut self.colors) }.srgba8()
    }

    /// A vertex without its colour. An element that is not there has its default.
    pub(super) fn vertex(&self, [_, uv, normal]: Corner) -> Vertex {
        let plain = plain_vertex();
        Vertex {
            uv: self.uvs.get(uv as usize).copied().unwrap_or(plain.uv),
            normal: self.normals.get(normal as usize).copied().unwrap_or(plain.normal),
            ..plain
        }
    }
}
