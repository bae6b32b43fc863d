//! Ambient occlusion from horizons: Bavoil and Sainz 2008, integrated with the cosine as Jimenez et al. 2016 do.
//!
//! A line through a pixel is a plane in space, through the camera's eye. The surface that rises highest beside the pixel's point within a
//! radius is the horizon, on each side of the line. Nothing below a horizon is open.

use glam::{DVec2, DVec3};

use crate::graph::{GraphImage, GraphPlace};

/// Points this near to a point are taken for its own surface.
const LEAST_WAY_M: f64 = 1e-4;

/// How many directions are searched around a point, an even number, and how many looks are taken along each.
#[derive(Debug, Clone, Copy)]
pub struct HorizonSearch {
    pub directions: u32,
    pub steps: u32,
    pub radius_m: f64,
}

/// A point of a surface and its normal, of unit length.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    pub point: DVec3,
    pub normal: DVec3,
}

/// Half a plane: the directions between the one towards the eye and the opposite one, on one side of it.
struct HalfPlane {
    /// The length of the normal's part in the plane.
    weight: f64,
    /// The angle from the direction towards the eye to the normal's part, positive to this side.
    normal_angle: f64,
}

impl HalfPlane {
    fn new(towards_eye: DVec3, along: DVec3, normal: DVec3) -> Self {
        let aside = along.reject_from_normalized(towards_eye).normalize_or_zero();
        let part = DVec2::new(normal.dot(towards_eye), normal.dot(aside));
        Self { weight: part.length(), normal_angle: part.y.atan2(part.x) }
    }

    /// The angles of the directions above the surface.
    fn above_surface(&self) -> [f64; 2] {
        let quarter = std::f64::consts::FRAC_PI_2;
        [self.normal_angle - quarter, self.normal_angle + quarter].map(|angle| angle.clamp(0.0, std::f64::consts::PI))
    }

    /// Light from the directions between two angles, by the cosine to the normal.
    fn light_between(&self, [first, last]: [f64; 2]) -> f64 {
        self.weight * (self.integral_until(last) - self.integral_until(first))
    }

    fn integral_until(&self, angle: f64) -> f64 {
        let gamma = self.normal_angle;
        0.25 * (2.0 * angle * gamma.sin() - (2.0 * angle - gamma).cos())
    }
}

/// Sums of half planes.
#[derive(Default)]
struct Light {
    all: f64,
    open: f64,
}

impl Light {
    fn add(&mut self, half: &HalfPlane, horizon: f64) {
        let [first, last] = half.above_surface();
        self.all += half.light_between([first, last]);
        self.open += half.light_between([first, horizon.clamp(first, last)]);
    }

    /// The share of light that does not arrive.
    fn occlusion(&self) -> f64 {
        if self.all > 0.0 { (1.0 - self.open / self.all).clamp(0.0, 1.0) } else { 0.0 }
    }
}

impl HorizonSearch {
    /// The occlusion of a point by an image's own lines (Rosen et al., section 6.3). `None` outside the image's frusta.
    pub fn in_image(&self, image: &GraphImage<'_>, at: SurfacePoint) -> Option<f64> {
        let place = image.camera.project(at.point)?;
        let frustum = &image.camera.frusta[place.frustum];
        let towards_eye = (frustum.eye_in_world - at.point).normalize_or_zero();
        let mut light = Light::default();
        for number in 0..self.directions {
            let direction = direction(number, self.directions);
            let along = frustum.direction(place.pixel + direction) - frustum.direction(place.pixel);
            let half = HalfPlane::new(towards_eye, along, at.normal);
            let cosines = self.ways(image, place, direction, at.point).map(|way| way.dot(towards_eye));
            light.add(&half, cosines.fold(-1.0, f64::max).clamp(-1.0, 1.0).acos());
        }
        Some(light.occlusion())
    }

    /// The occlusion of a point by the greatest horizon in any of several images. Horizons are kept by their azimuth around the normal:
    /// lines of different images are different planes.
    pub fn in_any_image(&self, images: &[GraphImage<'_>], at: SurfacePoint) -> f64 {
        let right = at.normal.any_orthonormal_vector();
        let ahead = at.normal.cross(right);
        // Twice as wide as the angle between directions, so that some look falls in each.
        let sectors = (self.directions as usize / 2).max(1);
        let mut sines = vec![0.0_f64; sectors];
        for way in images.iter().flat_map(|image| self.all_ways(image, at.point)) {
            let azimuth = way.dot(ahead).atan2(way.dot(right)).rem_euclid(std::f64::consts::TAU);
            let sector = (azimuth / std::f64::consts::TAU * sectors as f64) as usize;
            let sine = &mut sines[sector.min(sectors - 1)];
            *sine = sine.max(way.dot(at.normal));
        }
        // The share of a sector's light, by the cosine, that comes from below an elevation is its sine's square.
        sines.iter().map(|sine| sine.min(1.0).powi(2)).sum::<f64>() / sectors as f64
    }

    fn all_ways(&self, image: &GraphImage<'_>, point: DVec3) -> Vec<DVec3> {
        let Some(place) = image.camera.project(point) else { return Vec::new() };
        let directions = (0..self.directions).map(|number| direction(number, self.directions));
        directions.flat_map(|direction| self.ways(image, place, direction, point)).collect()
    }

    /// Ways of unit length from a point to the surfaces that an image shows in one direction of the image, within the radius.
    fn ways<'i>(
        &self,
        image: &'i GraphImage<'_>,
        place: GraphPlace,
        direction: DVec2,
        point: DVec3,
    ) -> impl Iterator<Item = DVec3> + use<'i> {
        let radius_m = self.radius_m;
        let steps = self.steps;
        let radius_px = radius_m / (image.camera.frusta[place.frustum].footprint() * place.w_m);
        let part = image.camera.part(place.frustum);
        (1..=steps).filter_map(move |step| {
            let pixel = place.pixel + direction * (radius_px * f64::from(step) / f64::from(steps));
            let way = image.point_at(part, pixel)? - point;
            let is_near = (LEAST_WAY_M..=radius_m).contains(&way.length());
            is_near.then(|| way.normalize_or_zero())
        })
    }
}

/// One of some directions around a pixel.
fn direction(number: u32, directions: u32) -> DVec2 {
    DVec2::from_angle(std::f64::consts::TAU * (f64::from(number) + 0.5) / f64::from(directions))
}

#[cfg(test)]
mod tests {
    use depth_image::{PinholeCamera, Ray};
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::graph::{GraphCamera, Met, pinhole};

    const SEARCH: HorizonSearch = HorizonSearch { directions: 32, steps: 200, radius_m: 6.0 };
    const WALL_HEIGHT_M: f32 = 1.0;

    /// A floor at y = 0 and a wall at x = 0 that is 1 m high, towards +x.
    fn meet(ray: &Ray, [near, far]: [f32; 2]) -> Option<Met> {
        let to_floor = -ray.origin_in_world.y / ray.direction_in_world.y;
        let to_wall = -ray.origin_in_world.x / ray.direction_in_world.x;
        let is_wall = (0.0..=WALL_HEIGHT_M).contains(&ray.at(to_wall).y);
        let floor = Met { t: to_floor, normal_in_world: Vec3::Y, color_linear: Vec3::ONE };
        let wall = Met { t: to_wall, normal_in_world: Vec3::X, color_linear: Vec3::ONE };
        let met = [(floor, true), (wall, is_wall)].into_iter();
        let met = met.filter(|(met, is)| *is && met.t > near && met.t < far).map(|(met, _)| met);
        met.min_by(|a, b| a.t.total_cmp(&b.t))
    }

    fn camera(eye: Vec3) -> GraphCamera {
        pinhole(&PinholeCamera::looking_at(eye, Vec3::new(0.5, 0.3, 0.0), Vec3::Y, 1.2, UVec2::splat(512))).unwrap()
    }

    /// A wall that has no end covers ½ (1 − cos of its elevation) of what a floor sees, weighted by the cosine.
    #[test]
    fn a_wall_covers_the_share_in_closed_form() {
        let cameras = [Vec3::new(6.0, 3.0, 0.0), Vec3::new(5.0, 4.0, 3.0)].map(camera);
        let images = cameras.each_ref().map(|camera| GraphImage::take(camera, meet));
        for away_m in [0.4, 0.8, 1.6] {
            let at = SurfacePoint { point: DVec3::new(away_m, 0.0, 0.1), normal: DVec3::Y };
            let expected = 0.5 * (1.0 - (1.0 / away_m).atan().cos());
            let own = SEARCH.in_image(&images[0], at).unwrap();
            assert!((own - expected).abs() < 0.03, "{away_m} m: {own}, not {expected}");
            // The greatest horizon of a sector counts for all of it.
            let shared = SEARCH.in_any_image(&images, at);
            assert!((shared - expected).abs() < 0.04, "{away_m} m, shared: {shared}, not {expected}");
        }
    }

    /// The second camera sees the wall from the other side of its upper edge.
    #[test]
    fn a_wall_that_hides_the_point_covers_it_in_shared_images_alone() {
        let at = SurfacePoint { point: DVec3::new(-0.5, 0.0, 0.0), normal: DVec3::Y };
        let cameras = [Vec3::new(4.0, 1.5, 0.0), Vec3::new(-4.0, 3.0, 0.0)].map(camera);
        let images = cameras.each_ref().map(|camera| GraphImage::take(camera, meet));
        let hidden = SEARCH.in_any_image(&images[..1], at);
        let shared = SEARCH.in_any_image(&images, at);
        let expected = 0.5 * (1.0 - 2.0_f64.atan().cos());
        assert!((hidden - expected).abs() < 0.05 && (shared - expected).abs() < 0.05, "{hidden}, {shared}");
    }

    #[test]
    fn an_open_floor_is_not_covered_and_no_point_gives_nan() {
        let camera = camera(Vec3::new(6.0, 3.0, 0.0));
        let image = GraphImage::take(&camera, meet);
        let far = SurfacePoint { point: DVec3::new(7.0, 0.0, 0.0), normal: DVec3::Y };
        assert!(SEARCH.in_any_image(std::slice::from_ref(&image), far) < 0.01);
        let eye = SurfacePoint { point: camera.frusta[0].eye_in_world, normal: DVec3::Y };
        assert!(SEARCH.in_any_image(std::slice::from_ref(&image), eye).is_finite());
        assert!(SEARCH.in_image(&image, eye).is_none_or(f64::is_finite));
    }
}
