//! Surfaces that an image holds: pixel redundancy, the measure of sampling methods (Xie §6.1.2).

use std::ops::Range;

use depth_image::{DepthImage, SurfaceId};
use glam::{Vec3, Vec4};

/// The surface ids of an image.
#[derive(Debug, Clone, Copy)]
pub struct ImageSurfaces<'a> {
    homogeneous_pixel_from_world: [Vec4; 3],
    columns: f32,
    rows: f32,
    near_m: f32,
    inverse_depth_per_m: &'a [f32],
    ids: &'a [SurfaceId],
}

/// A sample: its place in the image and in the world, and its surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldSample {
    /// The index in the image, row by row.
    pub index: usize,
    /// The position in the world.
    pub point_in_world: Vec3,
    /// The id of the triangle.
    pub id: SurfaceId,
}

impl<'a> ImageSurfaces<'a> {
    /// The surfaces of an image; `None` without surface ids.
    pub fn of(image: &'a DepthImage) -> Option<Self> {
        let camera = image.camera.reference();
        let size = camera.size_px.as_vec2();
        Some(Self {
            homogeneous_pixel_from_world: camera.homogeneous_pixel_from_world(),
            columns: size.x,
            rows: size.y,
            near_m: camera.near_m,
            inverse_depth_per_m: &image.inverse_depth_per_m,
            ids: image.surface_id.as_deref()?,
        })
    }

    /// True if the image has a sample of the same triangle at the pixel where the point is seen (Xie, Algorithm 3).
    pub fn has(&self, sample: &HeldSample) -> bool {
        self.has_within(sample, 0)
    }

    /// True if the image has a sample of the same triangle at the pixel where the point is seen, or at most `reach_px` away.
    pub fn has_within(&self, sample: &HeldSample, reach_px: usize) -> bool {
        let p = sample.point_in_world.extend(1.0);
        let [u, v, w] = self.homogeneous_pixel_from_world.map(|row| row.dot(p));
        let x = u / w;
        let y = v / w;
        if !(w > self.near_m && x >= 0.0 && y >= 0.0 && x < self.columns && y < self.rows) {
            return false;
        }
        let columns = self.columns as usize;
        let rows = self.rows as usize;
        around(y, reach_px, rows).any(|y| {
            around(x, reach_px, columns).any(|x| {
                let index = y * columns + x;
                self.inverse_depth_per_m[index] > 0.0 && self.ids[index] == sample.id
            })
        })
    }
}

/// The pixels around a place along one side of an image.
fn around(place: f32, reach_px: usize, count: usize) -> Range<usize> {
    let pixel = place as usize;
    pixel.saturating_sub(reach_px)..(pixel + reach_px + 1).min(count)
}

/// All samples of an image with surface ids, row by row.
pub fn held_samples(image: &DepthImage) -> Vec<HeldSample> {
    let Some(ids) = &image.surface_id else { return Vec::new() };
    let width = image.size_px().x;
    let samples = ids.iter().enumerate().filter_map(|(index, id)| {
        let point_in_world = image.sample_in_world(index as u32 % width, index as u32 / width)?;
        Some(HeldSample { index, point_in_world, id: *id })
    });
    samples.collect()
}

/// Whether one of some images has a sample.
pub fn is_held(sample: &HeldSample, images: &[ImageSurfaces<'_>]) -> bool {
    images.iter().any(|image| image.has(sample))
}

#[cfg(test)]
mod tests {
    use depth_image::{HOLE_INVERSE_DEPTH, PinholeCamera};
    use glam::UVec2;

    use super::*;

    #[test]
    fn an_image_holds_its_own_samples_and_no_holes() {
        let camera = PinholeCamera::looking_at(Vec3::Z * 4.0, Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(16, 12));
        let id = |i: u32| SurfaceId { instance: 0, primitive: i };
        let mut image = DepthImage {
            camera: camera.into(),
            inverse_depth_per_m: vec![0.25; 192],
            color_rgb9e5: vec![0; 192],
            normal_oct16: None,
            surface_id: Some((0..192).map(id).collect()),
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
            light: None,
        };
        let samples = held_samples(&image);
        assert_eq!(samples.len(), 192);
        let held = ImageSurfaces::of(&image).unwrap();
        assert!(samples.iter().all(|sample| held.has(sample)));
        let other = HeldSample { id: id(999), ..samples[5] };
        let beside = HeldSample { point_in_world: Vec3::X * 9.0, ..samples[5] };
        assert!(!held.has(&other) && !held.has(&beside));
        image.inverse_depth_per_m[5] = HOLE_INVERSE_DEPTH;
        let held = ImageSurfaces::of(&image).unwrap();
        assert!(!held.has(&samples[5]));
        let beside = HeldSample { id: id(6), ..samples[5] };
        let far = HeldSample { id: id(7), ..samples[5] };
        assert!(held.has_within(&beside, 1) && !held.has_within(&far, 1) && held.has_within(&far, 2));
        assert_eq!(held_samples(&image).len(), 191);
    }
}
