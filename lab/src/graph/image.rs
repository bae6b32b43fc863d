//! Images of a graph camera: the first surface on each texel's ray, taken by rays.

use depth_image::{Ray, linear_from_rgb9e5, oct16_from_unit, rgb9e5_from_linear, unit_from_oct16};
use glam::{DVec2, DVec3, UVec2, Vec3};
use rayon::prelude::*;

use super::camera::{GraphCamera, GraphPlace, Piece};

/// Neighbouring samples lie on one surface if each lies within this many footprints of the other's tangent plane.
const SURFACE_FOOTPRINTS: f64 = 2.0;

/// What a ray meets.
#[derive(Debug, Clone, Copy)]
pub struct Met {
    /// The ray's parameter.
    pub t: f32,
    pub normal_in_world: Vec3,
    pub color_linear: Vec3,
}

/// The surface that a texel shows.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    pub inverse_w_per_m: f32,
    frustum: u32,
    normal_oct16: u32,
    color_rgb9e5: u32,
}

/// An image of a scene.
pub struct GraphImage<'c> {
    pub camera: &'c GraphCamera,
    pub parts: Vec<Part>,
}

/// The texels of the whole image, or of one frustum.
pub struct Part {
    pub size_px: UVec2,
    /// `None` where the ray leaves all frusta, or its own for the next.
    pub samples: Vec<Option<Sample>>,
    /// Of the cell between a texel and its neighbours to the right and below: all four show one surface.
    connected: Vec<bool>,
}

/// The corners of a cell, in the order of [`Part::corners`].
pub const CORNERS: [UVec2; 4] = [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE];

impl Sample {
    pub fn frustum(&self) -> usize {
        self.frustum as usize
    }

    pub fn color_linear(&self) -> Vec3 {
        linear_from_rgb9e5(self.color_rgb9e5)
    }

    pub fn normal_in_world(&self) -> DVec3 {
        unit_from_oct16(self.normal_oct16).as_dvec3()
    }
}

impl<'c> GraphImage<'c> {
    /// Takes an image of surfaces that rays meet between two parameters.
    pub fn take(camera: &'c GraphCamera, meet: impl Fn(&Ray, [f32; 2]) -> Option<Met> + Sync) -> Self {
        let parts = camera.parts_px().iter().enumerate().map(|(part, &size_px)| {
            let texels = (0..size_px.element_product()).into_par_iter();
            let samples = texels.map(|texel| {
                let pixel = center(UVec2::new(texel % size_px.x, texel / size_px.x));
                camera.pieces(part, pixel).iter().find_map(|piece| sample_of(piece, &meet))
            });
            Part { size_px, samples: samples.collect(), connected: Vec::new() }
        });
        let mut image = Self { camera, parts: parts.collect() };
        for part in 0..image.parts.len() {
            image.parts[part].connected = image.connected_cells(part);
        }
        image
    }

    /// The point that a texel shows.
    pub fn point(&self, sample: &Sample, texel: UVec2) -> DVec3 {
        let w_m = f64::from(sample.inverse_w_per_m).recip();
        self.camera.unproject(GraphPlace { frustum: sample.frustum(), pixel: center(texel), w_m })
    }

    /// The point that the texel around a place of a part shows; `None` outside the image and where it shows nothing.
    pub fn point_at(&self, part: usize, pixel: DVec2) -> Option<DVec3> {
        let part = &self.parts[part];
        let texel = pixel.floor();
        let is_inside = texel.cmpge(DVec2::ZERO).all() && texel.cmplt(part.size_px.as_dvec2()).all();
        let texel = texel.as_uvec2();
        let sample = is_inside.then(|| part.at(texel)).flatten()?;
        Some(self.point(&sample, texel))
    }

    fn connected_cells(&self, part: usize) -> Vec<bool> {
        let size_px = self.parts[part].size_px;
        let cells = (0..size_px.element_product()).into_par_iter();
        cells.map(|cell| self.is_one_cell(part, UVec2::new(cell % size_px.x, cell / size_px.x))).collect()
    }

    /// All edges of a cell lie on one surface.
    fn is_one_cell(&self, part: usize, cell: UVec2) -> bool {
        let part = &self.parts[part];
        if (cell + 1).cmpge(part.size_px).any() {
            return false;
        }
        let corners = CORNERS.map(|corner| {
            let sample = part.at(cell + corner)?;
            Some((sample, self.point(&sample, cell + corner)))
        });
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { return false };
        [[a, b], [c, d], [a, c], [b, d]].iter().all(|edge| self.is_one_surface(edge))
    }

    /// In space: codes of different frusta cannot be compared.
    fn is_one_surface(&self, [(a, at_a), (b, at_b)]: &[(Sample, DVec3); 2]) -> bool {
        let slack_m = SURFACE_FOOTPRINTS * self.footprint_m(a).max(self.footprint_m(b));
        let way = *at_b - *at_a;
        a.normal_in_world().dot(way).abs() <= slack_m && b.normal_in_world().dot(way).abs() <= slack_m
    }

    /// The side of a texel at a sample.
    fn footprint_m(&self, sample: &Sample) -> f64 {
        self.camera.frusta[sample.frustum()].footprint() / f64::from(sample.inverse_w_per_m)
    }
}

impl Part {
    pub fn at(&self, texel: UVec2) -> Option<Sample> {
        self.samples[(texel.y * self.size_px.x + texel.x) as usize]
    }

    pub fn corners(&self, cell: UVec2) -> [Option<Sample>; 4] {
        CORNERS.map(|corner| self.at(cell + corner))
    }

    pub fn is_connected(&self, cell: UVec2) -> bool {
        self.connected[(cell.y * self.size_px.x + cell.x) as usize]
    }
}

/// The middle of a texel.
pub fn center(texel: UVec2) -> DVec2 {
    texel.as_dvec2() + 0.5
}

fn sample_of(piece: &Piece, meet: &impl Fn(&Ray, [f32; 2]) -> Option<Met>) -> Option<Sample> {
    let ray =
        Ray { origin_in_world: piece.eye_in_world.as_vec3(), direction_in_world: piece.direction_in_world.as_vec3() };
    let met = meet(&ray, piece.span_m.map(|w_m| w_m as f32))?;
    Some(Sample {
        inverse_w_per_m: met.t.recip(),
        frustum: piece.frustum as u32,
        normal_oct16: oct16_from_unit(met.normal_in_world),
        color_rgb9e5: rgb9e5_from_linear(met.color_linear),
    })
}
