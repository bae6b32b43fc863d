//! Depth as 15-bit codes, which neighbours are one surface, and the min-max pyramid over them.

use depth_image::DepthImage;

/// Code of a texel without a sample.
pub(crate) const HOLE_CODE: u16 = 0;
/// Code of a texel whose ray meets nothing: farther than every sample.
pub(crate) const BACKGROUND_CODE: u16 = 1;
const FIRST_CODE: f32 = 2.0;
/// Between the codes of the background and of the farthest sample.
pub(crate) const FIRST_SAMPLE: f32 = 1.5;
const LAST_CODE: f32 = 32_767.0;

/// Neighbours whose depths differ by less than this number of footprints are one surface.
pub(crate) const FLAT_FOOTPRINTS: f32 = 2.0;
/// The greatest distance of a jump in depth from the jump before or after it on one surface, in footprints.
const SLOPE_FOOTPRINTS: f32 = 2.0;
/// The same, as a share of the jump.
pub(crate) const SLOPE_SHARE: f32 = 0.2;

/// A depth plane as codes linear in inverse depth: `code = scale / planar_depth_m + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct CodedDepth {
    /// Columns and rows.
    pub size_px: [u32; 2],
    /// Row by row.
    pub codes: Vec<u16>,
    /// Codes per inverse metre.
    pub scale: f32,
    /// The code of infinity; negative or up to 2.
    pub offset: f32,
    /// Cells between four texels whose corners are samples of one surface.
    pub connected: Vec<bool>,
    /// Texels whose way is not proven free: their rays passed surfaces that other images hold, or they are holes. Empty
    /// where all ways are proven free.
    pub uncertain: Vec<bool>,
}

impl CodedDepth {
    /// Quantises a depth image over its own range.
    #[must_use]
    pub fn of(image: &DepthImage) -> Self {
        let [least, range] = least_and_range(image);
        let scale = (LAST_CODE - FIRST_CODE) / range;
        let offset = FIRST_CODE - least * scale;
        let codes = image.inverse_depth_per_m.iter().map(|&inverse| match inverse {
            d if d > 0.0 => (d * scale + offset).round().clamp(FIRST_CODE, LAST_CODE) as u16,
            0.0 => BACKGROUND_CODE,
            _ => HOLE_CODE,
        });
        let codes: Vec<u16> = codes.collect();
        Self {
            size_px: image.size_px().to_array(),
            uncertain: uncertain_texels(image, &codes),
            codes,
            scale,
            offset,
            connected: connected_cells(image, image.camera.reference().focal_px.min_element()),
        }
    }

    /// Quantises one image of a set. In a set with holes the lowest bit of a sample says that its way is not proven free.
    pub(crate) fn in_set(image: &DepthImage, among_holes: bool) -> Self {
        let mut depth = Self::of(image);
        if among_holes {
            let marks = depth.uncertain.iter().copied().chain(std::iter::repeat(false));
            for (code, mark) in depth.codes.iter_mut().zip(marks).filter(|(code, _)| **code > BACKGROUND_CODE) {
                *code = (*code & !1) | u16::from(mark);
            }
        }
        depth
    }

    /// How far the farthest sample may lie from where its code puts it, and half as much again for rounding.
    pub(crate) fn greatest_error_m(image: &DepthImage, among_holes: bool) -> f32 {
        let [least, range] = least_and_range(image);
        // A mark takes the place of the lowest bit.
        let codes = if among_holes { 1.75 } else { 0.75 };
        codes * range / (LAST_CODE - FIRST_CODE) / (least * least)
    }

    /// Two words for each texel and the cell to its lower right, row by row. They are the codes of the cell's upper and of
    /// its lower corners, left in the low half and right in the high half. The highest bit of the first says that the cell is
    /// connected; that of the second, that some corner is uncertain. Bit 15 of the first says that the texel is uncertain.
    pub(crate) fn cell_words(&self) -> Vec<[u32; 2]> {
        let [columns, rows] = self.size_px.map(|side| side as usize);
        let mut words = Vec::with_capacity(columns * rows);
        for y in 0..rows {
            let corners = cell_row(&self.codes, columns, y).map(|corners| corners.map(u32::from));
            words.extend(corners.map(|[a, b, c, d]| [a | b << 16, c | d << 16]));
        }
        for (word, &connected) in words.iter_mut().zip(&self.connected) {
            word[0] |= u32::from(connected) << 31;
        }
        for (y, row) in words.chunks_mut(columns).enumerate().filter(|_| !self.uncertain.is_empty()) {
            for (word, corners) in row.iter_mut().zip(cell_row(&self.uncertain, columns, y)) {
                word[0] |= u32::from(corners[0]) << 15;
                word[1] |= u32::from(corners.contains(&true)) << 31;
            }
        }
        words
    }

    /// The place of a texel; of positions beyond the border, that of the border's.
    fn index(&self, x: u32, y: u32) -> usize {
        let x = x.min(self.size_px[0] - 1);
        let y = y.min(self.size_px[1] - 1);
        (y * self.size_px[0] + x) as usize
    }

    pub(crate) fn at(&self, x: u32, y: u32) -> u16 {
        self.codes[self.index(x, y)]
    }

    /// See [`CodedDepth::uncertain`].
    pub(crate) fn is_uncertain(&self, x: u32, y: u32) -> bool {
        self.uncertain.get(self.index(x, y)) == Some(&true)
    }

    /// The range of a texel; an uncertain one may be anything.
    fn range(&self, x: u32, y: u32) -> u32 {
        let code = u32::from(self.at(x, y));
        if self.is_uncertain(x, y) || code == u32::from(HOLE_CODE) { 0x0000_ffff } else { code << 16 | code }
    }
}

/// Some texel of a set is uncertain. Holes are counted as they are coded: a depth that is not a number is one, too.
pub(crate) fn is_among_holes(images: &[DepthImage]) -> bool {
    images.iter().any(|image| {
        image.passed.as_ref().is_some_and(|passed| passed.contains(&true))
            || image.inverse_depth_per_m.iter().any(|&inverse| inverse.is_nan() || inverse < 0.0)
    })
}

fn uncertain_texels(image: &DepthImage, codes: &[u16]) -> Vec<bool> {
    let texels = codes.iter().enumerate().map(|(index, &code)| code == HOLE_CODE || image.has_passed(index));
    let texels: Vec<bool> = texels.collect();
    if texels.contains(&true) { texels } else { Vec::new() }
}

/// A row of cells, one to the lower right of each texel. Their values are those of a plane at their upper left, upper
/// right, lower left and lower right corners. The border's values go on beyond the border.
pub(crate) fn cell_row<T: Copy>(plane: &[T], columns: usize, y: usize) -> impl Iterator<Item = [T; 4]> {
    let [upper, lower] = [y, (y + 1).min(plane.len() / columns - 1)].map(|y| &plane[y * columns..][..columns]);
    let last = columns - 1;
    let inside = upper.windows(2).zip(lower.windows(2)).map(|(u, l)| [u[0], u[1], l[0], l[1]]);
    inside.chain(std::iter::once([upper[last], upper[last], lower[last], lower[last]]))
}

/// The least inverse depth of an image's samples, and how far its codes reach from there.
fn least_and_range(image: &DepthImage) -> [f32; 2] {
    let (least, greatest) = image.inverse_depth_range().unwrap_or((0.5, 1.0));
    // One depth only still needs a scale.
    [least, (greatest - least).max(greatest * 1e-4)]
}

/// A cell is connected where all four of its edges are.
fn connected_cells(image: &DepthImage, focal_px: f32) -> Vec<bool> {
    let [columns, rows] = image.size_px().to_array().map(|side| side as usize);
    let plane = &image.inverse_depth_per_m;
    let across = |x: usize, y: usize| is_one_surface(plane, y * columns + x, 1, x, columns, focal_px);
    let down = |x: usize, y: usize| is_one_surface(plane, y * columns + x, columns, y, rows, focal_px);
    let mut connected = vec![false; columns * rows];
    for y in 0..rows - 1 {
        let mut left = down(0, y);
        for x in 0..columns - 1 {
            let right = down(x + 1, y);
            connected[y * columns + x] = left && right && across(x, y) && across(x, y + 1);
            left = right;
        }
    }
    connected
}

/// The samples at `index` and `index + stride` lie on one surface: they are close in depth, or the slope between them goes
/// on before or after. They are the `place`-th and the next of `count` in their row or column. Planes are linear in
/// inverse depth, so that no plane is ever cut, however steep.
fn is_one_surface(plane: &[f32], index: usize, stride: usize, place: usize, count: usize, focal_px: f32) -> bool {
    let a = plane[index];
    let b = plane[index + stride];
    if a <= 0.0 || b <= 0.0 {
        return false;
    }
    let footprint = a.max(b) / focal_px;
    let jump = b - a;
    if jump.abs() <= FLAT_FOOTPRINTS * footprint {
        return true;
    }
    let before = (place > 0).then(|| plane[index - stride]).filter(|&d| d > 0.0).map(|d| a - d);
    let after = (place + 2 < count).then(|| plane[index + 2 * stride]).filter(|&d| d > 0.0).map(|d| d - b);
    let slack = SLOPE_FOOTPRINTS * footprint;
    [before, after].into_iter().flatten().any(|slope| (slope - jump).abs() <= slack.max(SLOPE_SHARE * jump.abs()))
}

/// Levels of words over the cells between texel centres, sides padded to powers of two. Level 0 is the cells and has
/// no words.
///
/// A word of level `n` holds the nearest code (low) and the farthest (high) of the corners of 2ⁿ × 2ⁿ cells. A hole
/// among them may be anything: nearest 65535, farthest 0.
pub(crate) struct Pyramid {
    /// The sides of level 0.
    pub log2_sides: [u32; 2],
    /// Level after level, from level 1.
    pub words: Vec<u32>,
}

impl Pyramid {
    pub fn of(depth: &CodedDepth) -> Self {
        let log2_sides = Self::log2_sides(depth.size_px);
        let mut words = Vec::with_capacity(Self::word_count(log2_sides));
        words.extend(nodes(log2_sides, 1).map(|(x, y)| corner_range(depth, 2 * x as u32, 2 * y as u32)));
        for level in 2..=log2_sides[0].min(log2_sides[1]) {
            let below = Self::level_begin(log2_sides, level - 1);
            let columns = 2usize << (log2_sides[0] - level);
            for (x, y) in nodes(log2_sides, level) {
                let upper = below + 2 * y * columns + 2 * x;
                let children = [upper, upper + 1, upper + columns, upper + columns + 1];
                words.push(children.map(|child| words[child]).into_iter().fold(NOTHING, join));
            }
        }
        Self { log2_sides, words }
    }

    /// The padded sides of an image.
    pub fn log2_sides(size_px: [u32; 2]) -> [u32; 2] {
        size_px.map(|side| side.max(2).next_power_of_two().ilog2())
    }

    /// Words of all levels of padded sides.
    pub fn word_count(log2_sides: [u32; 2]) -> usize {
        let [short, long] = [log2_sides[0].min(log2_sides[1]), log2_sides[0].max(log2_sides[1])];
        Self::level_begin(log2_sides, short) + (1 << (long - short))
    }

    /// Where a level from 1 on begins; the shaders' formula.
    pub fn level_begin(log2_sides: [u32; 2], level: u32) -> usize {
        let finest = 1usize << (log2_sides[0] + log2_sides[1] - 2);
        (finest - (finest >> (2 * (level - 1)))) / 3 * 4
    }

    /// Nearest codes of 2 × 2 nodes each, at the places of the nodes: what a disc's footprint needs, in one
    /// load.
    pub fn wide_words(&self) -> Vec<u32> {
        let mut wide = Vec::with_capacity(self.words.len());
        for level in 1..=self.log2_sides[0].min(self.log2_sides[1]) {
            let begin = Self::level_begin(self.log2_sides, level);
            let [columns, rows] = self.log2_sides.map(|side| 1usize << (side - level));
            wide.extend(nodes(self.log2_sides, level).map(|(x, y)| {
                let right = (x + 1).min(columns - 1);
                let [upper, lower] = [y, (y + 1).min(rows - 1)].map(|y| begin + y * columns);
                let places = [upper + x, upper + right, lower + x, lower + right];
                places.into_iter().fold(0, |nearest, place| nearest.max(self.words[place] & 0xffff))
            }));
        }
        wide
    }
}

/// The columns and rows of a level's nodes, row by row.
fn nodes(log2_sides: [u32; 2], level: u32) -> impl Iterator<Item = (usize, usize)> {
    let [columns, rows] = log2_sides.map(|side| 1usize << (side - level));
    (0..rows).flat_map(move |y| (0..columns).map(move |x| (x, y)))
}

/// The range of no corner at all.
const NOTHING: u32 = 0xffff_0000;

/// The range of the 3 × 3 corners of 2 × 2 cells; of none beyond the image.
fn corner_range(depth: &CodedDepth, x: u32, y: u32) -> u32 {
    if x >= depth.size_px[0] || y >= depth.size_px[1] {
        return NOTHING;
    }
    (0..9).map(|i| depth.range(x + i % 3, y + i / 3)).fold(NOTHING, join)
}

fn join(a: u32, b: u32) -> u32 {
    let nearest = (a & 0xffff).max(b & 0xffff);
    let farthest = (a >> 16).min(b >> 16);
    farthest << 16 | nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coded(size_px: [u32; 2], code: impl Fn(u32, u32) -> u16) -> CodedDepth {
        let codes =
            (0..size_px[1]).flat_map(|y| (0..size_px[0]).map(move |x| (x, y))).map(|(x, y)| code(x, y)).collect();
        let connected = vec![true; (size_px[0] * size_px[1]) as usize];
        CodedDepth { size_px, codes, scale: 1.0, offset: 0.0, connected, uncertain: Vec::new() }
    }

    #[test]
    fn every_node_bounds_its_corners() {
        let depth = coded([37, 22], |x, y| 2 + ((x * 7919 + y * 104_729) % 30_000) as u16);
        let pyramid = Pyramid::of(&depth);
        for level in 1..=5 {
            let begin = Pyramid::level_begin(pyramid.log2_sides, level);
            let columns = 64usize >> level;
            for (x, y) in (0..36).flat_map(|x| (0..21).map(move |y| (x, y))) {
                let word = pyramid.words[begin + (y >> level) as usize * columns + (x >> level) as usize];
                for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let code = u32::from(depth.at(x + i, y + j));
                    assert!(code <= word & 0xffff && code >= word >> 16, "level {level} cell {x} {y}");
                }
            }
        }
    }

    #[test]
    fn a_hole_certifies_nothing() {
        let depth = coded([8, 8], |x, y| if (x, y) == (5, 2) { HOLE_CODE } else { 100 });
        let pyramid = Pyramid::of(&depth);
        let top = pyramid.words[Pyramid::level_begin(pyramid.log2_sides, 3)];
        assert_eq!(top, 0x0000_ffff);
    }
}
