//! A view by projecting all samples of layered images, with its holes repaired by rays (Lischinski §4.1).

use depth_image::{LayeredDepthImage, PinholeCamera};
use glam::{IVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::pyramid::{Hit, Pyramids};

/// A pixel that is farther than most of its neighbours by this factor is a hole.
const FARTHER: f32 = 1.02;

/// A view's nearest samples, its holes, and the nodes and samples that their repair read.
pub struct Warped {
    /// With planar depth as parameter.
    pub hits: Vec<Option<Hit>>,
    pub is_hole: Vec<bool>,
    pub loads: usize,
}

/// Projects all samples that face the eye, one pixel each: the nearest counts, among equals the last. Then follows a ray through each
/// hole.
pub fn warp(images: &[LayeredDepthImage], pyramids: &Pyramids<'_>, camera: &PinholeCamera) -> Warped {
    let mut hits = vec![None; camera.pixel_count()];
    for (number, image) in images.iter().enumerate() {
        project(number, image, camera, &mut hits);
    }
    let is_hole: Vec<bool> = (0..hits.len()).map(|pixel| is_hole(&hits, camera, pixel)).collect();
    let holes: Vec<usize> = (0..hits.len()).filter(|&pixel| is_hole[pixel]).collect();
    let repaired =
        holes.par_iter().map(|&pixel| pyramids.trace(camera.ray(place(camera, pixel).as_vec2() + 0.5), camera.near_m));
    let repaired: Vec<(Option<Hit>, usize)> = repaired.collect();
    holes.iter().zip(&repaired).for_each(|(&pixel, (hit, _))| hits[pixel] = *hit);
    Warped { hits, is_hole, loads: repaired.iter().map(|(_, loads)| loads).sum() }
}

fn project(number: usize, image: &LayeredDepthImage, camera: &PinholeCamera, hits: &mut [Option<Hit>]) {
    let [right, down, forward] = image.camera.axes_in_world();
    let rows = camera.homogeneous_pixel_from_world();
    for line in 0..image.camera.pixel_count() {
        let columns = image.camera.size_px.x as usize;
        let at_m = Vec2::new((line % columns) as f32 + 0.5, (line / columns) as f32 + 0.5) * image.camera.spacing_m;
        let origin = image.camera.corner_in_world + right * at_m.x + down * at_m.y;
        for sample in image.line(line) {
            let point_in_world = origin + forward * image.planar_depth_m[sample];
            let [u, v, planar_depth_m] = rows.map(|row| row.dot(point_in_world.extend(1.0)));
            let pixel = Vec2::new(u, v) / planar_depth_m;
            let towards: Vec3 = point_in_world - camera.eye_in_world;
            let is_front = image.plane_normal_in_world(sample).dot(towards) < 0.0;
            if planar_depth_m < camera.near_m || !camera.contains(pixel) || !is_front {
                continue;
            }
            let nearest = &mut hits[pixel.y as usize * camera.size_px.x as usize + pixel.x as usize];
            if nearest.is_none_or(|nearest| planar_depth_m <= nearest.t) {
                *nearest = Some(Hit { t: planar_depth_m, image: number, sample });
            }
        }
    }
}

fn place(camera: &PinholeCamera, pixel: usize) -> IVec2 {
    let columns = camera.size_px.x as usize;
    IVec2::new((pixel % columns) as i32, (pixel / columns) as i32)
}

/// Nothing is there, or most neighbours are clearly nearer.
fn is_hole(hits: &[Option<Hit>], camera: &PinholeCamera, pixel: usize) -> bool {
    let Some(own) = hits[pixel] else { return true };
    let size = camera.size_px.as_ivec2();
    let middle = place(camera, pixel);
    let around = (-1..=1).flat_map(|y| (-1..=1).map(move |x| middle + IVec2::new(x, y))).filter(|&at| at != middle);
    let mut count = 0;
    let mut nearer = 0;
    for at in around.filter(|at| at.cmpge(IVec2::ZERO).all() && at.cmplt(size).all()) {
        let neighbour = hits[(at.y * size.x + at.x) as usize];
        count += 1;
        nearer += usize::from(neighbour.is_some_and(|hit| hit.t * FARTHER < own.t));
    }
    2 * nearer > count
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;
    use crate::layered::pyramid::tests::image;

    fn view(size_px: UVec2) -> PinholeCamera {
        PinholeCamera::looking_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, 2.0 * 0.24_f32.atan(), size_px)
    }

    #[test]
    fn a_plane_fills_views_whose_pixels_are_larger_than_texels_and_rays_fill_the_others() {
        let images = [image(UVec2::new(64, 48), |_| vec![(4.0, Vec3::Z)])];
        let pyramids = Pyramids::new(&images);
        for (size_px, has_holes) in [(UVec2::new(32, 24), false), (UVec2::new(128, 96), true)] {
            let warped = warp(&images, &pyramids, &view(size_px));
            assert!(warped.hits.iter().all(|hit| hit.is_some_and(|hit| (hit.t - 5.0).abs() < 1e-5)), "{size_px}");
            assert_eq!((warped.is_hole.contains(&true), warped.loads > 0), (has_holes, has_holes), "{size_px}");
        }
    }

    /// A known failure of the paper's test for holes: most neighbours have nothing that could be nearer.
    #[test]
    fn a_plane_shows_through_between_the_samples_of_one_in_front() {
        let images = [image(UVec2::new(64, 48), |_| vec![(4.0, Vec3::Z), (6.0, Vec3::Z)])];
        let warped = warp(&images, &Pyramids::new(&images), &view(UVec2::new(128, 96)));
        assert!(warped.hits.iter().flatten().any(|hit| hit.t > 6.0));
    }

    #[test]
    fn a_far_pixel_among_near_ones_is_a_hole() {
        let camera = view(UVec2::splat(3));
        let at = |t| Some(Hit { t, image: 0, sample: 0 });
        let mut hits = vec![at(1.0); 9];
        hits[4] = at(1.03);
        let holes = |hits: &[Option<Hit>]| (0..9).filter(|&pixel| is_hole(hits, &camera, pixel)).collect::<Vec<_>>();
        assert_eq!(holes(&hits), [4]);
        hits[..4].fill(at(1.03));
        assert_eq!(holes(&hits), [0; 0]);
        hits[8] = None;
        assert_eq!(holes(&hits), [8]);
    }
}
