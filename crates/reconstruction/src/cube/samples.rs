//! The samples of a cube's three images, in the cube's own space.

use depth_image::{CubeGrid, LayeredDepthImage};
use glam::{UVec2, UVec3, Vec3};
use rayon::prelude::*;

/// The numbers of the samples on a sample's surface in the neighbouring lines: in the lines before and after along the next axis, and
/// along the axis after that. A sample without such a neighbour has its own number.
pub(crate) type Links = [u32; 4];

/// The samples of all lines: those along the first axis, then the second, then the third; along each axis line after line, by the
/// coordinate along the next axis first. Lengths are in spacings.
pub(crate) struct CubeSamples {
    /// Cells along each axis.
    pub size: UVec3,
    /// The number of the first line along each axis.
    pub first_line: [u32; 3],
    /// The first sample of each line, and at last the number of samples.
    pub first: Vec<u32>,
    /// Along the line's axis; does not fall along a line.
    pub depth: Vec<f32>,
    /// Unit normals in the cube's space.
    pub normal: Vec<Vec3>,
    pub color_rgb9e5: Vec<u32>,
    /// The line of each sample.
    pub line: Vec<u32>,
    /// The place of each sample among those of its image.
    pub place: Vec<u32>,
}

impl CubeSamples {
    /// The samples of images along the grid's axes.
    pub fn of(grid: &CubeGrid, images: &[LayeredDepthImage; 3]) -> Self {
        let count = images.iter().map(LayeredDepthImage::sample_count).sum();
        let lines: usize = images.iter().map(|image| image.camera.pixel_count()).sum();
        let mut all = Self {
            size: grid.size,
            first_line: [0; 3],
            first: Vec::with_capacity(lines + 1),
            depth: Vec::with_capacity(count),
            normal: Vec::with_capacity(count),
            color_rgb9e5: Vec::with_capacity(count),
            line: Vec::with_capacity(count),
            place: Vec::with_capacity(count),
        };
        (0..3).for_each(|axis| all.append(grid, axis, &images[axis]));
        all.first.push(all.depth.len() as u32);
        all
    }

    /// Lines look against their axis: their samples turn round.
    fn append(&mut self, grid: &CubeGrid, axis: usize, image: &LayeredDepthImage) {
        self.first_line[axis] = self.first.len() as u32;
        let [columns, rows] = image.camera.size_px.to_array();
        let cube_from_world = grid.world_from_cube.inverse();
        let end = self.size[axis] as f32;
        for row in (0..rows).rev() {
            for column in 0..columns {
                let line = self.first.len() as u32;
                self.first.push(self.depth.len() as u32);
                for sample in image.line((row * columns + column) as usize).rev() {
                    self.depth.push((end - image.planar_depth_m[sample] / grid.spacing_m).clamp(0.0, end));
                    self.normal.push(cube_from_world * image.plane_normal_in_world(sample));
                    self.color_rgb9e5.push(image.color_rgb9e5[sample]);
                    self.line.push(line);
                    self.place.push(sample as u32);
                }
            }
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.depth.len()
    }

    /// The axis of a line.
    pub fn axis_of(&self, line: u32) -> usize {
        usize::from(line >= self.first_line[1]) + usize::from(line >= self.first_line[2])
    }

    /// The place of a line among those of its axis, along the next axis and the one after it.
    pub fn place_of(&self, axis: usize, line: u32) -> UVec2 {
        let place = line - self.first_line[axis];
        let columns = self.size[(axis + 1) % 3];
        UVec2::new(place % columns, place / columns)
    }

    /// The samples of a line.
    pub fn on_line(&self, line: u32) -> std::ops::Range<usize> {
        self.first[line as usize] as usize..self.first[line as usize + 1] as usize
    }

    /// Whether the next sample is the other side of the same surface.
    pub(super) fn has_other_side(&self, sample: usize) -> bool {
        let next = sample + 1;
        next < self.len()
            && self.line[next] == self.line[sample]
            && self.depth[next] == self.depth[sample]
            && self.normal[next].dot(self.normal[sample]) < OPPOSITE
    }

    /// The texels of `cube_samples` in `cube/colors.wgsl`.
    pub(super) fn words(&self, links: &[Links]) -> Vec<[u32; 4]> {
        let words = self.color_rgb9e5.par_iter().zip(links).enumerate();
        let words = words.map(|(sample, (&color_rgb9e5, &[before, after, above, below]))| {
            [color_rgb9e5, (sample as u32 - before) | (after - sample as u32) << 16, above, below]
        });
        words.collect()
    }

    /// Slopes of a sample's plane: how far it moves along its line from one line to the next, along the next axis and the one after
    /// it.
    pub(super) fn slopes(&self, sample: usize, axis: usize) -> [f32; 2] {
        let normal = self.normal[sample];
        let own = normal[axis].abs().max(LEAST_SLOPE_DIVISOR).copysign(normal[axis]);
        [1, 2].map(|offset| -normal[(axis + offset) % 3] / own)
    }
}

/// The cosine between opposite normals, but for the rounding of both.
const OPPOSITE: f32 = -0.9999;
/// Steeper planes count as being as steep as this.
const LEAST_SLOPE_DIVISOR: f32 = 1e-3;
