//! Indirect light of samples with less noise. It changes slowly along a surface, so that a texel takes the mean over near texels of its
//! surface: once for all views of a set. An à-trous filter (Dammertz et al. 2010) by places and normals alone; shadows of lamps are
//! in another word of light.

use depth_image::{DepthImage, PixelDepth, linear_from_rgb9e5, rgb9e5_from_linear, unit_from_oct16};
use glam::{IVec2, UVec2, Vec3};
use rayon::prelude::*;

/// Texels between those that a pass averages.
const STEPS_PX: [i32; 3] = [1, 2, 4];
/// Texels of one surface: the cosines between the normals of their triangles and of shading, and the distance from a texel's plane.
const LEAST_TRIANGLE_COSINE: f32 = 0.92;
const LEAST_NORMAL_COSINE: f32 = 0.97;
const PLANE_FOOTPRINTS: f32 = 0.5;

/// The surface of a texel.
struct Surface {
    point_in_world: Vec3,
    triangle_normal: Vec3,
    normal: Vec3,
    footprint_m: f32,
}

impl Surface {
    fn is_that_of(&self, other: &Self) -> bool {
        let off_plane_m = self.triangle_normal.dot(other.point_in_world - self.point_in_world).abs();
        self.triangle_normal.dot(other.triangle_normal) >= LEAST_TRIANGLE_COSINE
            && self.normal.dot(other.normal) >= LEAST_NORMAL_COSINE
            && off_plane_m <= PLANE_FOOTPRINTS * self.footprint_m
    }
}

/// An image whose light from all around, RGB9E5, is smooth along surfaces. Images without light stay as they are.
#[must_use]
pub fn smoothed(image: &DepthImage) -> DepthImage {
    let mut smooth = image.clone();
    let Some(light) = &mut smooth.light else { return smooth };
    let words = &light.environment_rgb9e5;
    let surfaces: Vec<Option<Surface>> = (0..words.len()).into_par_iter().map(|place| surface(image, place)).collect();
    let mut linear: Vec<Vec3> = words.iter().map(|&word| linear_from_rgb9e5(word)).collect();
    for step_px in STEPS_PX {
        let places = (0..linear.len()).into_par_iter();
        linear = places.map(|place| mean_around(&surfaces, &linear, image.size_px(), place, step_px)).collect();
    }
    light.environment_rgb9e5 = linear.into_iter().map(rgb9e5_from_linear).collect();
    smooth
}

/// The mean over a texel and the eight around it that are on its surface, by a binomial kernel.
fn mean_around(surfaces: &[Option<Surface>], linear: &[Vec3], size_px: UVec2, place: usize, step_px: i32) -> Vec3 {
    let Some(own) = &surfaces[place] else { return linear[place] };
    let at = IVec2::new(place as i32 % size_px.x as i32, place as i32 / size_px.x as i32);
    let mut sum = Vec3::ZERO;
    let mut weight = 0.0;
    for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
        let near = at + IVec2::new(dx, dy) * step_px;
        if near.cmplt(IVec2::ZERO).any() || near.cmpge(size_px.as_ivec2()).any() {
            continue;
        }
        let near = (near.y * size_px.x as i32 + near.x) as usize;
        if surfaces[near].as_ref().is_some_and(|other| own.is_that_of(other)) {
            let share = [4.0, 2.0, 1.0][(dx.abs() + dy.abs()) as usize];
            sum += linear[near] * share;
            weight += share;
        }
    }
    sum / weight
}

/// `None` where a texel shows none.
fn surface(image: &DepthImage, place: usize) -> Option<Surface> {
    let light = image.light.as_ref()?;
    let normals = image.normal_oct16.as_ref()?;
    let camera = image.camera.pinhole()?;
    let inverse_depth_per_m = image.inverse_depth_per_m[place];
    let width_px = image.size_px().x;
    let pixel = UVec2::new(place as u32 % width_px, place as u32 / width_px).as_vec2() + 0.5;
    let planar_depth_m = inverse_depth_per_m.recip();
    (inverse_depth_per_m > 0.0).then(|| Surface {
        point_in_world: camera.unproject(PixelDepth { pixel, planar_depth_m }),
        triangle_normal: unit_from_oct16(light.triangle_normal_oct16[place]),
        normal: unit_from_oct16(normals[place]),
        footprint_m: planar_depth_m / camera.focal_px.min_element(),
    })
}
