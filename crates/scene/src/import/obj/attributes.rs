//! The numbered elements that faces refer to.

use glam::DVec3;

use super::text::{Line, floats};
use crate::error::Fault;

/// The numbered elements of faces.
#[derive(Default)]
pub(super) struct Attributes {
    pub(super) positions_in_source: Vec<DVec3>,
    /// Colours, one for each position once any position has one.
    pub(super) colors_srgba8: Vec<[u8; 4]>,
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) normals: Vec<[f32; 3]>,
}

impl Attributes {
    /// `v x y z`, optionally followed by a weight or a colour, as several programs write it.
    pub(super) fn push_position(&mut self, line: &Line) -> Result<(), Fault> {
        let [x, y, z, a, g, b] = floats::<6>(line, 3)?;
        let position = DVec3::new(x, y, z);
        let count = line.rest.split_ascii_whitespace().count();
        if count >= 6 {
            self.colors_srgba8.resize(self.positions_in_source.len(), [255; 4]);
            let [r, g, b] = [a, g, b].map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
            self.colors_srgba8.push([r, g, b, 255]);
        }
        let is_weighted = count == 4 && a != 0.0;
        self.positions_in_source.push(if is_weighted { position / a } else { position });
        Ok(())
    }
}
