//! A sample image as the searches read it.

use depth_image::{DepthImage, linear_from_rgb9e5};
use glam::{UVec2, Vec2, Vec3, Vec4};

use crate::{
    pyramid::{BACKGROUND_CODE, CodedDepth, Pyramid},
    sample_set::stretch,
    view_work::FAR_AWAY,
};

/// One sample image, its depth as codes and their pyramid.
pub(super) struct SampleCamera {
    homogeneous_pixel_from_world: [Vec4; 3],
    pub eye_in_world: Vec3,
    /// Columns and rows less one: cells lie between texel centres.
    pub cells: Vec2,
    pub focal_px: f32,
    /// See `sample_set::stretch`.
    pub stretch: f32,
    /// This camera's bit in provenance.
    pub mask: u32,
    /// Some texels of some image of the set prove nothing of what lies before them.
    pub among_holes: bool,
    depth: CodedDepth,
    pyramid: Pyramid,
    wide_words: Vec<u32>,
    colors_linear: Vec<Vec3>,
}

/// The corners of a cell or of a texel, in their order.
pub(super) const CORNERS: [UVec2; 4] = [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE];

/// A cell's corners: codes of the upper left, upper right, lower left and lower right sample, and whether
/// they are one surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corners {
    pub codes: [f32; 4],
    pub connected: bool,
    /// The ways to all four are proven free.
    pub certain: bool,
    /// 1 for each corner whose own way is, else 0.
    pub proven: [f32; 4],
}

/// The nearest code in a node's word; a hole may be as near as anything, nearer than any code.
fn nearest_code(word: u32) -> f32 {
    if word & 0xffff == 0xffff { FAR_AWAY } else { (word & 0xffff) as f32 }
}

impl SampleCamera {
    pub fn of(image: &DepthImage, mask: u32, among_holes: bool) -> Self {
        let camera = image.camera.reference();
        let depth = CodedDepth::in_set(image, among_holes);
        let pyramid = Pyramid::of(&depth);
        Self {
            homogeneous_pixel_from_world: camera.homogeneous_pixel_from_world(),
            eye_in_world: camera.eye_in_world,
            cells: camera.size_px.as_vec2() - 1.0,
            focal_px: camera.focal_px.min_element(),
            stretch: stretch(camera),
            mask,
            among_holes,
            wide_words: pyramid.wide_words(),
            pyramid,
            depth,
            colors_linear: image.color_rgb9e5.iter().map(|&packed| linear_from_rgb9e5(packed)).collect(),
        }
    }

    /// (column · w, row · w, w), w the planar depth, of a point (1) or a direction (0).
    pub fn homogeneous(&self, v: Vec4) -> Vec3 {
        Vec3::from_array(self.homogeneous_pixel_from_world.map(|row| row.dot(v)))
    }

    /// Codes from infinity to a reciprocal depth.
    pub fn code_above(&self, inverse_depth_per_m: f32) -> f32 {
        self.depth.scale * inverse_depth_per_m
    }

    pub fn code(&self, inverse_depth_per_m: f32) -> f32 {
        self.code_above(inverse_depth_per_m) + self.depth.offset
    }

    pub fn inverse_depth_per_m(&self, code: f32) -> f32 {
        (code - self.depth.offset) / self.depth.scale
    }

    pub fn code_offset(&self) -> f32 {
        self.depth.offset
    }

    pub fn code_at(&self, texel: UVec2) -> u16 {
        self.depth.at(texel.x, texel.y)
    }

    /// Nothing before a texel's sample is proven free.
    pub fn is_uncertain(&self, texel: UVec2) -> bool {
        self.depth.is_uncertain(texel.x, texel.y)
    }

    /// Nothing before some sample is proven free.
    pub fn has_uncertain(&self) -> bool {
        !self.depth.uncertain.is_empty()
    }

    pub fn color_linear(&self, texel: UVec2) -> Vec3 {
        self.colors_linear[(texel.y * self.depth.size_px[0] + texel.x) as usize]
    }

    pub fn corners(&self, cell: UVec2) -> Corners {
        let raw = CORNERS.map(|corner| self.code_at(cell + corner));
        let marks = raw.map(|code| if self.among_holes && code > BACKGROUND_CODE { code & 1 } else { 0 });
        Corners {
            codes: [0, 1, 2, 3].map(|i| f32::from(raw[i] - marks[i])),
            proven: marks.map(|mark| f32::from(1 - mark)),
            connected: self.depth.connected[(cell.y * self.depth.size_px[0] + cell.x) as usize],
            certain: !CORNERS.iter().any(|&corner| self.is_uncertain(cell + corner)),
        }
    }

    /// The coarsest level.
    pub fn top_level(&self) -> u32 {
        let [columns, rows] = self.pyramid.log2_sides;
        columns.min(rows)
    }

    /// Nearest and farthest code of a node of level 1 or coarser.
    pub fn range(&self, level: u32, node: UVec2) -> (f32, f32) {
        let word = self.pyramid.words[self.node_index(level, node)];
        (nearest_code(word), (word >> 16) as f32)
    }

    /// Nearest code of 2 × 2 nodes.
    pub fn wide_nearest(&self, level: u32, node: UVec2) -> f32 {
        nearest_code(self.wide_words[self.node_index(level, node)])
    }

    fn node_index(&self, level: u32, node: UVec2) -> usize {
        let columns = self.pyramid.log2_sides[0] - level;
        Pyramid::level_begin(self.pyramid.log2_sides, level) + ((node.y << columns) + node.x) as usize
    }
}
