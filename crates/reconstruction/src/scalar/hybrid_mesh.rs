//! Twin of `hybrid_mesh.wgsl` and `merge.wgsl`: each sample a quad of its texel, and flat rectangles of them merged.

use depth_image::{DepthImage, PinholeCamera, unit_from_oct16};
use glam::{UVec2, Vec2, Vec3};

use super::{sample_camera::CORNERS, view_ray::places};
use crate::{
    methods::hybrid_mesh::GREATEST_SLOPE,
    pyramid::{FLAT_FOOTPRINTS, SLOPE_SHARE},
    quads::{ErrorBound, GREATEST_EXTENT, Quad},
};

/// An image, cut.
struct Cut<'i> {
    camera: &'i PinholeCamera,
    /// The corners of each sample's quad.
    inverse_depths: Vec<[f32; 4]>,
    /// Columns and rows in texels, of the quad that begins at each sample; 0 where none does.
    extents: Vec<UVec2>,
}

/// In the order of their upper left samples; none where a plane is missing.
pub(super) fn quads(number: usize, image: &DepthImage, merged: Option<ErrorBound>) -> Vec<Quad> {
    let Some(mut cut) = Cut::of(image) else { return Vec::new() };
    if let Some(bound) = merged {
        cut.merge_all(bound.px());
    }
    (0..cut.extents.len()).filter(|&sample| cut.extents[sample].x > 0).map(|sample| cut.quad(number, sample)).collect()
}

/// A sample and its plane.
struct Sample {
    inverse_depth: f32,
    ray: Vec3,
    normal: Vec3,
}

impl Sample {
    /// Where a plane through the sample meets another ray.
    fn on_plane(&self, normal: Vec3, ray: Vec3) -> f32 {
        let along = normal.dot(self.ray);
        self.inverse_depth * normal.dot(ray) / if along.abs() < 1e-12 { 1e-12 } else { along }
    }

    /// No discontinuity lies between the sample and what its corner's ray meets.
    fn shares(&self, held: f32, ray: Vec3, focal_px: f32) -> bool {
        let slack = FLAT_FOOTPRINTS * held.max(self.inverse_depth) / focal_px;
        let expected = self.on_plane(self.normal, ray);
        let sloped = (held - expected).abs() <= slack.max(SLOPE_SHARE * (expected - self.inverse_depth).abs());
        held > 0.0 && ((held - self.inverse_depth).abs() <= slack || sloped)
    }

    /// On the sample's own plane as far as that is not too steep; nearer where the ray is known to go past the surface.
    fn guess(&self, held: f32, ray: Vec3, focal_px: f32) -> f32 {
        let guess = self.on_plane(tamed(self.normal, self.ray), ray);
        let steepest = Vec2::splat(0.5).length() * GREATEST_SLOPE;
        let footprints = if held >= 0.0 && held < guess { FLAT_FOOTPRINTS } else { steepest };
        let reach = self.inverse_depth * (footprints / focal_px).min(0.5);
        guess.max(self.inverse_depth - reach).min(self.inverse_depth + reach)
    }
}

/// Faces the eye, by at least as much as a surface of the greatest slope.
fn tamed(normal: Vec3, ray: Vec3) -> Vec3 {
    let towards = ray.normalize_or(Vec3::NEG_Z);
    let facing = if normal.dot(towards) > 0.0 { -normal } else { normal };
    let cosine = -facing.dot(towards);
    let least_cosine = (1.0 + GREATEST_SLOPE * GREATEST_SLOPE).sqrt().recip();
    if cosine >= least_cosine {
        return facing;
    }
    let sideways = facing + towards * cosine;
    (sideways * (GREATEST_SLOPE / sideways.length().max(1e-6)) - towards) * least_cosine
}

impl<'i> Cut<'i> {
    fn of(image: &'i DepthImage) -> Option<Self> {
        let normals = image.normal_oct16.as_ref()?;
        let corners = image.corner_inverse_depth_per_m.as_ref()?;
        let camera = image.camera.reference();
        let width = camera.size_px.x;
        let focal_px = camera.focal_px.min_element();
        let inverse_depths = places(camera.size_px).enumerate().map(|(index, texel)| {
            let inverse_depth = image.inverse_depth_per_m[index];
            let ray = camera.ray(texel.as_vec2() + 0.5).direction_in_world;
            let sample = Sample { inverse_depth, ray, normal: unit_from_oct16(normals[index]) };
            CORNERS.map(|offset| {
                let at = texel + offset;
                let held = corners[(at.y * (width + 1) + at.x) as usize];
                let ray = camera.ray(at.as_vec2()).direction_in_world;
                if sample.shares(held, ray, focal_px) { held } else { sample.guess(held, ray, focal_px) }
            })
        });
        Some(Self {
            camera,
            inverse_depths: inverse_depths.collect(),
            extents: image.inverse_depth_per_m.iter().map(|&d| UVec2::splat(u32::from(d > 0.0))).collect(),
        })
    }

    fn index(&self, texel: UVec2) -> usize {
        (texel.y * self.camera.size_px.x + texel.x) as usize
    }

    fn texel(&self, sample: usize) -> UVec2 {
        let width = self.camera.size_px.x;
        UVec2::new(sample as u32 % width, sample as u32 / width)
    }

    /// The corners of a block.
    fn merged(&self, origin: UVec2, size: UVec2) -> [f32; 4] {
        [0, 1, 2, 3].map(|i| self.inverse_depths[self.index(origin + CORNERS[i] * (size - 1))][i])
    }

    fn quad(&self, number: usize, sample: usize) -> Quad {
        let origin = self.texel(sample);
        let extent = self.extents[sample];
        let depths = self.merged(origin, extent);
        let corners_in_world =
            [0, 1, 2, 3].map(|i| self.camera.ray((origin + CORNERS[i] * extent).as_vec2()).at(depths[i].recip()));
        let last = self.index(origin + extent - 1);
        Quad { image: number, corners_in_world, samples: [sample as u32, last as u32] }
    }

    /// Rows into runs, then columns of equal runs into rectangles.
    fn merge_all(&mut self, bound_px: f32) {
        for along in [UVec2::X, UVec2::Y] {
            let across = UVec2::ONE - along;
            let segments = self.camera.size_px.dot(along).div_ceil(GREATEST_EXTENT.dot(along));
            for line in 0..self.camera.size_px.dot(across) {
                for segment in 0..segments {
                    self.merge_segment(across * line + along * GREATEST_EXTENT * segment, along, bound_px);
                }
            }
        }
    }

    fn merge_segment(&mut self, first: UVec2, along: UVec2, bound_px: f32) {
        let length = (self.camera.size_px - first).min(GREATEST_EXTENT).dot(along);
        let mut place = 0;
        while place < length {
            let origin = first + along * place;
            let extent = self.extents[self.index(origin)];
            let following = (0..length - place).map(|i| self.extents[self.index(origin + along * i)]);
            let alike = following.take_while(|&other| other == extent).count() as u32;
            let count = if extent.x > 0 { self.longest_run(origin, extent, along, alike, bound_px) } else { alike };
            (0..count).for_each(|i| self.set_extent(origin + along * i, UVec2::ZERO));
            self.set_extent(origin, times(extent, along, count));
            place += count;
        }
    }

    fn set_extent(&mut self, texel: UVec2, extent: UVec2) {
        let index = self.index(texel);
        self.extents[index] = extent;
    }

    /// How many of the quads that are alike become one.
    fn longest_run(&self, origin: UVec2, extent: UVec2, along: UVec2, alike: u32, bound_px: f32) -> u32 {
        let mut count = 1;
        let mut step = GREATEST_EXTENT.dot(along) / 2;
        while step > 0 {
            let longer = count + step;
            if longer <= alike && self.error_px(origin, times(extent, along, longer)) <= bound_px {
                count = longer;
            }
            step /= 2;
        }
        count
    }

    /// How far the merged quad is off the corners of all samples in the block. On the outline it counts twice: there a
    /// crack opens to both sides.
    fn error_px(&self, origin: UVec2, size: UVec2) -> f32 {
        let merged = self.merged(origin, size);
        let corners = places(size).flat_map(|place| (0..4).map(move |i| (place, i)));
        let errors = corners.map(|(place, i)| {
            let depth = self.inverse_depths[self.index(origin + place)][i];
            let at = place + CORNERS[i];
            let surface = on_triangles(merged, at.as_vec2() / size.as_vec2());
            let ray = self.camera.ray((origin + at).as_vec2()).direction_in_world;
            let on_outline = at.cmpeq(UVec2::ZERO).any() || at.cmpeq(size).any();
            let sides = if on_outline { 2.0 } else { 1.0 };
            sides * self.camera.focal_px.min_element() * ray.length() * (surface - depth).abs() / surface
        });
        errors.fold(0.0, f32::max)
    }
}

/// The extent of `count` quads along an axis.
fn times(extent: UVec2, along: UVec2, count: u32) -> UVec2 {
    extent * (UVec2::ONE + along * (count - 1))
}

/// The two triangles that are drawn; linear in the image, as planes are.
fn on_triangles([a, b, c, d]: [f32; 4], at: Vec2) -> f32 {
    if at.element_sum() <= 1.0 {
        a + (b - a) * at.x + (c - a) * at.y
    } else {
        d + (c - d) * (1.0 - at.x) + (b - d) * (1.0 - at.y)
    }
}
