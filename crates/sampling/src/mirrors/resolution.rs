//! How finely images resolve what a mirror shows.

use depth_image::Camera;
use glam::Vec3;
use rayon::prelude::*;

use super::seen::{Ways, sees};

/// The mean side of texels where rays end at surfaces, each in the image that shows its end finest. `None` where no image shows any.
pub(super) fn mean_side_m(cameras: &[Camera], ways: &Ways<'_>) -> Option<f32> {
    let side_m = |camera: &Camera, end: Vec3| {
        let at = camera.project(end).filter(|_| sees(camera, end, ways.triangles))?;
        Some(at.planar_depth_m / camera.reference().focal_px.min_element())
    };
    let finest_m = |end: Vec3| cameras.iter().filter_map(|camera| side_m(camera, end)).min_by(f32::total_cmp);
    let ends = ways.deciding.par_iter().filter(|way| way.ends_at_surface).filter_map(|way| way.places().last());
    let sides: Vec<f32> = ends.filter_map(finest_m).collect();
    (!sides.is_empty()).then(|| sides.iter().sum::<f32>() / sides.len() as f32)
}
