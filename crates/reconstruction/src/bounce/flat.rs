//! Images whose samples lie on one plane: a ray meets it in closed form (Rosen et al., section 6.1: billboards).

use bytemuck::{Pod, Zeroable};
use depth_image::{BACKGROUND_INVERSE_DEPTH, DepthImage};
use glam::{DMat3, DVec3, UVec2, Vec3};

/// Samples are as near to the plane, in footprints.
const MOST_APART_FOOTPRINTS: f64 = 0.5;
/// Three samples that span less than this, in square pixels, tell no plane.
const LEAST_SPAN_PX2: f64 = 16.0;

/// `planes` of `bounce/march_flat.wgsl`: of each image.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuPlane {
    pub plane: [f32; 3],
    /// 1 where the image is flat, else 0.
    pub is_flat: f32,
}

impl GpuPlane {
    pub fn of(plane: Option<Vec3>) -> Self {
        Self { plane: plane.unwrap_or_default().to_array(), is_flat: f32::from(u8::from(plane.is_some())) }
    }
}

/// The plane of an image of a pinhole without holes whose samples all lie on it: the inverse depth of a sample, in 1/m, is that of
/// plane · (column, row, 1).
#[must_use]
pub fn plane_of(image: &DepthImage) -> Option<Vec3> {
    let focal_px = f64::from(image.camera.pinhole()?.focal_px.min_element());
    if image.passed.is_some() || image.inverse_depth_per_m.iter().any(|depth| *depth < BACKGROUND_INVERSE_DEPTH) {
        return None;
    }
    let columns = image.size_px().x;
    let known = (0u32..).zip(&image.inverse_depth_per_m).filter(|(_, depth)| **depth > BACKGROUND_INVERSE_DEPTH);
    let samples = known.map(|(index, depth)| {
        let pixel = UVec2::new(index % columns, index / columns).as_dvec2() + 0.5;
        (pixel.extend(1.0), f64::from(*depth))
    });
    let plane = through(samples.clone())?;
    let is_on_it =
        |(place, depth): (DVec3, f64)| (plane.dot(place) - depth).abs() <= MOST_APART_FOOTPRINTS * depth / focal_px;
    samples.clone().all(is_on_it).then(|| plane.as_vec3())
}

/// The plane through three samples that are far apart.
fn through(samples: impl Iterator<Item = (DVec3, f64)> + Clone) -> Option<DVec3> {
    let farthest = |far: &dyn Fn(DVec3) -> f64| samples.clone().max_by(|a, b| far(a.0).total_cmp(&far(b.0)));
    let a = samples.clone().next()?;
    let b = farthest(&|place| place.distance_squared(a.0))?;
    let span_px2 = |place: DVec3| (b.0 - a.0).cross(place - a.0).length();
    let c = farthest(&span_px2)?;
    let places = DMat3::from_cols(a.0, b.0, c.0).transpose();
    (span_px2(c.0) > LEAST_SPAN_PX2).then(|| places.inverse() * DVec3::new(a.1, b.1, c.1))
}

#[cfg(test)]
mod tests {
    use depth_image::{Camera, HOLE_INVERSE_DEPTH, PinholeCamera, PixelDepth};

    use super::*;

    /// In the middle of the last row.
    const OTHER: usize = 29 * 40 + 20;

    /// What a camera sees of the ground 2 m below, but for one texel, whose inverse depth is given.
    fn ground(other: Option<f32>) -> DepthImage {
        let size_px = UVec2::new(40, 30);
        let camera = PinholeCamera::looking_at(Vec3::Y * 2.0, Vec3::new(3.0, 0.5, 1.0), Vec3::Y, 1.2, size_px);
        let texel = |index: u32| {
            let ray = camera.ray(UVec2::new(index % size_px.x, index / size_px.x).as_vec2() + 0.5);
            let way = -ray.origin_in_world.y / ray.direction_in_world.y;
            let seen = camera.project(ray.at(way)).filter(|_| way > 0.0);
            seen.map_or(BACKGROUND_INVERSE_DEPTH, |at| at.planar_depth_m.recip())
        };
        let mut inverse_depth_per_m: Vec<f32> = (0..size_px.element_product()).map(texel).collect();
        if let Some(other) = other {
            inverse_depth_per_m[OTHER] = other;
        }
        DepthImage {
            camera: Camera::Pinhole(camera),
            color_rgb9e5: vec![0; inverse_depth_per_m.len()],
            inverse_depth_per_m,
            normal_oct16: None,
            surface_id: None,
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
        }
    }

    #[test]
    fn the_ground_is_flat_and_its_plane_is_at_its_height() {
        let image = ground(None);
        assert!(image.inverse_depth_per_m.contains(&BACKGROUND_INVERSE_DEPTH), "the sky is seen as well");
        let plane = plane_of(&image).expect("it is flat");
        let camera = image.camera.pinhole().expect("a pinhole");
        for (x, y) in [(3.5, 28.5), (20.5, 25.5), (39.5, 20.5)] {
            let planar_depth_m = plane.dot(Vec3::new(x, y, 1.0)).recip();
            let point = camera.unproject(PixelDepth { pixel: glam::Vec2::new(x, y), planar_depth_m });
            assert!(point.y.abs() < 1e-3, "{point}");
        }
    }

    #[test]
    fn what_stands_on_the_ground_and_holes_are_not_flat() {
        let own = ground(None).inverse_depth_per_m[OTHER];
        assert!(plane_of(&ground(Some(own * 1.001))).is_some(), "within half a footprint");
        assert_eq!(plane_of(&ground(Some(own * 1.1))), None);
        assert_eq!(plane_of(&ground(Some(HOLE_INVERSE_DEPTH))), None);
        let mut sky = ground(None);
        sky.inverse_depth_per_m.fill(BACKGROUND_INVERSE_DEPTH);
        assert_eq!(plane_of(&sky), None);
    }
}
