//! The rays of a picture's pixels.

use depth_image::{PinholeCamera, Ray};
use glam::UVec2;
use rayon::prelude::*;
use render::scalar;

/// Rays of unit length through the middles of pixels, row by row.
pub fn unit_rays(camera: &PinholeCamera) -> impl IndexedParallelIterator<Item = Ray> {
    let camera = *camera;
    let size_px = camera.size_px;
    (0..size_px.element_product()).into_par_iter().map(move |pixel| {
        let ray = scalar::rays::pixel_ray(&camera, UVec2::new(pixel % size_px.x, pixel / size_px.x));
        Ray { direction_in_world: ray.direction_in_world.normalize_or_zero(), ..ray }
    })
}
