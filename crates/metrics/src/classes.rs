//! Pixel classes: errors of edges, of surfaces that no sample camera saw, and of all others.

use depth_image::{DepthImage, PinholeCamera, PixelDepth};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::{MetricsError, error::expect_len, steps::step_pixels};

/// The class of a pixel of the reference: the first of these that holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PixelClass {
    /// Within 2 px of a step in the reference's inverse depth ([`crate::step_pixels`]), on either side.
    Silhouette,
    /// A surface that matches no sample camera's depth.
    Disoccluded,
    /// Any other surface.
    Covered,
    /// No surface.
    Background,
}

/// The tolerance of a point to a sample's depth, in units of `z / f`: three texel footprints…
const MATCH_FOOTPRINTS: f32 = 3.0;
/// …or this share of its depth, if that is more.
const MATCH_RELATIVE: f32 = 0.01;

/// Classifies every pixel of a reference.
///
/// `reference_inverse_depth` is per metre of planar depth: above 0 a surface, anything else background. A
/// point matches a sample camera if the texel that it projects into holds a depth within
/// `max(3·z/f, 1 %)` of the point's own depth `z` there. A hole matches nothing: in a non-redundant set the
/// point's sample is in another image.
///
/// # Errors
/// Planes do not fit their cameras.
pub fn classify(
    reference_camera: &PinholeCamera,
    reference_inverse_depth: &[f32],
    sample_images: &[DepthImage],
) -> Result<Vec<PixelClass>, MetricsError> {
    expect_len("reference depth", reference_inverse_depth.len(), reference_camera.pixel_count())?;
    for (index, image) in sample_images.iter().enumerate() {
        image.validate().map_err(|source| MetricsError::SampleImage { index, source })?;
    }
    let width_px = reference_camera.size_px.x;
    let near_step = step_pixels(reference_inverse_depth, width_px);
    let pixels = reference_inverse_depth.par_iter().zip(&near_step).enumerate();
    Ok(pixels
        .map(|(index, (&inverse_depth, &near_step))| match inverse_depth > 0.0 {
            _ if near_step => PixelClass::Silhouette,
            false => PixelClass::Background,
            true => surface_class(surface_point(reference_camera, index, inverse_depth), sample_images),
        })
        .collect())
}

/// The share of pixels whose surface no sample image holds, over all pixels with a surface, silhouettes included;
/// `None` where there is no surface. In a scene of edges alone, all pixels are silhouettes.
///
/// # Errors
/// Planes do not fit their cameras.
pub fn unheld_rate(
    reference_camera: &PinholeCamera,
    reference_inverse_depth: &[f32],
    sample_images: &[DepthImage],
) -> Result<Option<f64>, MetricsError> {
    expect_len("reference depth", reference_inverse_depth.len(), reference_camera.pixel_count())?;
    let surfaces = reference_inverse_depth.iter().enumerate().filter(|&(_, &inverse)| inverse > 0.0);
    let points = surfaces.map(|(index, &inverse)| surface_point(reference_camera, index, inverse));
    let points: Vec<Vec3> = points.collect();
    let unheld = points.par_iter().filter(|&&point| surface_class(point, sample_images) == PixelClass::Disoccluded);
    Ok((!points.is_empty()).then(|| unheld.count() as f64 / points.len() as f64))
}

fn surface_point(camera: &PinholeCamera, index: usize, inverse_depth: f32) -> Vec3 {
    let width = camera.size_px.x as usize;
    let pixel = Vec2::new((index % width) as f32 + 0.5, (index / width) as f32 + 0.5);
    camera.unproject(PixelDepth { pixel, planar_depth_m: inverse_depth.recip() })
}

fn surface_class(point_in_world: Vec3, sample_images: &[DepthImage]) -> PixelClass {
    let is_held = sample_images.iter().any(|image| matches_sample(image, point_in_world));
    if is_held { PixelClass::Covered } else { PixelClass::Disoccluded }
}

fn matches_sample(image: &DepthImage, point_in_world: Vec3) -> bool {
    let camera = image.camera.reference();
    let Some(at) = image.camera.project(point_in_world).filter(|at| camera.contains(at.pixel)) else {
        return false;
    };
    let texel = at.pixel.as_uvec2().min(camera.size_px - 1);
    let sampled = image.inverse_depth_per_m[texel.y as usize * camera.size_px.x as usize + texel.x as usize];
    let tolerance = (MATCH_FOOTPRINTS / camera.focal_px.min_element()).max(MATCH_RELATIVE) * at.planar_depth_m;
    sampled > 0.0 && (sampled.recip() - at.planar_depth_m).abs() <= tolerance
}

#[cfg(test)]
mod tests {
    use super::*;
    use depth_image::Camera;
    use glam::UVec2;

    /// A card 2 m ahead that hides the middle of a wall 4 m ahead, seen from `(eye_x, 0, 0)`.
    fn card_before_wall(eye_x: f32) -> (PinholeCamera, Vec<f32>) {
        let eye = Vec3::new(eye_x, 0.0, 0.0);
        let camera = PinholeCamera::looking_at(eye, eye - Vec3::Z, Vec3::Y, 1.0, UVec2::new(160, 120));
        let depth_at = |index: usize| {
            let pixel = Vec2::new((index % 160) as f32 + 0.5, (index / 160) as f32 + 0.5);
            let ray = camera.ray(pixel);
            let card = ray.at(2.0);
            let wall = ray.at(4.0);
            match (card.x.abs() < 0.4 && card.y.abs() < 0.4, wall.x.abs() < 2.0 && wall.y.abs() < 1.5) {
                (true, _) => 0.5,
                (false, true) => 0.25,
                (false, false) => 0.0,
            }
        };
        let inverse_depth = (0..camera.pixel_count()).map(depth_at).collect();
        (camera, inverse_depth)
    }

    fn sample(eye_x: f32) -> DepthImage {
        let (camera, inverse_depth_per_m) = card_before_wall(eye_x);
        let color_rgb9e5 = vec![0; inverse_depth_per_m.len()];
        DepthImage {
            camera: Camera::Pinhole(camera),
            inverse_depth_per_m,
            color_rgb9e5,
            normal_oct16: None,
            surface_id: None,
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
            light: None,
        }
    }

    fn count(classes: &[PixelClass], class: PixelClass) -> usize {
        classes.iter().filter(|&&one| one == class).count()
    }

    #[test]
    fn classes_partition_all_pixels_and_all_occur() {
        let (camera, depth) = card_before_wall(0.0);
        let classes = classify(&camera, &depth, &[sample(0.4)]).unwrap();
        assert_eq!(classes.len(), camera.pixel_count());
        let all = [PixelClass::Silhouette, PixelClass::Disoccluded, PixelClass::Covered, PixelClass::Background];
        assert_eq!(all.iter().map(|&class| count(&classes, class)).sum::<usize>(), classes.len());
        assert!(all.iter().all(|&class| count(&classes, class) > 100));
    }

    #[test]
    fn a_camera_covers_all_that_it_sees() {
        let (camera, depth) = card_before_wall(0.0);
        let classes = classify(&camera, &depth, &[sample(0.0)]).unwrap();
        assert_eq!(count(&classes, PixelClass::Disoccluded), 0);
        assert_eq!(unheld_rate(&camera, &depth, &[sample(0.0)]).unwrap(), Some(0.0));
    }

    #[test]
    fn a_surface_behind_the_card_is_disoccluded() {
        let (camera, depth) = card_before_wall(0.0);
        let classes = classify(&camera, &depth, &[sample(0.4)]).unwrap();
        // The card's shadow on the wall moves by 0.4 m of 4 m: 0.4 · f / 4 columns of the view, less the silhouette.
        let columns = 0.4 * camera.focal_px.x / 4.0;
        let rows = 0.8 * camera.focal_px.y / 2.0;
        let disoccluded = count(&classes, PixelClass::Disoccluded) as f32;
        assert!((disoccluded / ((columns - 2.0) * rows) - 1.0).abs() < 0.1, "{disoccluded}");
        let surfaces = depth.iter().filter(|&&depth| depth > 0.0).count() as f64;
        let unheld = unheld_rate(&camera, &depth, &[sample(0.4)]).unwrap().unwrap() * surfaces;
        assert!((unheld / f64::from(columns * rows) - 1.0).abs() < 0.1, "{unheld}: with what lies beside steps");
    }

    #[test]
    fn with_no_samples_everything_is_disoccluded() {
        let (camera, depth) = card_before_wall(0.0);
        assert_eq!(count(&classify(&camera, &depth, &[]).unwrap(), PixelClass::Covered), 0);
    }

    #[test]
    fn an_empty_view_has_no_rate() {
        let (camera, depth) = card_before_wall(0.0);
        assert_eq!(unheld_rate(&camera, &vec![0.0; depth.len()], &[]).unwrap(), None);
        assert!(unheld_rate(&camera, &[0.0], &[]).is_err());
    }

    #[test]
    fn bad_planes_are_named() {
        let (camera, depth) = card_before_wall(0.0);
        assert!(matches!(classify(&camera, &depth[1..], &[]), Err(MetricsError::BufferSize { .. })));
        let mut bad = sample(0.0);
        bad.inverse_depth_per_m.pop();
        assert!(matches!(
            classify(&camera, &depth, &[sample(0.0), bad]),
            Err(MetricsError::SampleImage { index: 1, .. })
        ));
    }
}
