//! The twin of `light_cache.wgsl`: light of samples at one surface, under a gradient from all around.

use depth_image::{
    DepthImage, Illumination, LightCacheQuality, LightPlanes, MAX_LAMP_SHARES, PixelDepth, linear_from_rgb9e5,
    unit_from_oct16,
};
use glam::{UVec2, Vec2, Vec3};

use crate::light_samples::{DEPTH_CODES, LookUpTests};

/// A surface of a view.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    /// Where it is.
    pub point_in_world: Vec3,
    /// That of shading.
    pub normal_in_world: Vec3,
    /// The triangle's, towards the side that is seen.
    pub triangle_normal_in_world: Vec3,
    /// A pixel's side on a surface that faces the view.
    pub footprint_m: f32,
}

/// Light of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledLight {
    /// What a white surface reflects of lamps.
    pub lamps_linear: Vec3,
    /// What a white surface reflects of the environment.
    pub environment_linear: Vec3,
    /// The images whose texels count, one bit each.
    pub camera_mask: u32,
    /// Whether the texels are enough, and agree. Where they do not, lamps have rays of their own, as has occlusion; indirect light
    /// is that of the texels all the same.
    pub is_known: bool,
}

/// Sums over texels by their weights.
#[derive(Debug, Clone, Copy, Default)]
struct WeightedLight {
    lamps_linear: Vec3,
    environment_linear: Vec3,
    weight: f32,
}

impl WeightedLight {
    fn add(&mut self, light: &Self, share: f32) {
        self.lamps_linear += light.lamps_linear * share;
        self.environment_linear += light.environment_linear * share;
        self.weight += light.weight * share;
    }
}

/// What has been found in all images so far.
struct Findings {
    light: WeightedLight,
    coverage: f32,
    least_luminance: f32,
    greatest_luminance: f32,
    camera_mask: u32,
}

/// The sample images, and the light of their scene.
pub struct LightSamples<'a> {
    /// Images of light.
    pub images: &'a [DepthImage],
    /// Lamps and a gradient.
    pub illumination: &'a Illumination,
}

const BORDER_PX: f32 = 2.0;
const GRAZING_SHARE: f32 = 0.02;
const LEAST_WEIGHT: f32 = 0.02;
const LEAST_LUMINANCE: f32 = 0.05;
const MOST_RATIO: f32 = 4.0;
const SAME_NORMAL: f32 = 0.99999;

impl LightSamples<'_> {
    /// The light of a surface; `None` where no texel counts.
    ///
    /// # Panics
    /// Images that are no pinholes', or without light.
    #[must_use]
    pub fn look_up(&self, point: &SurfacePoint, quality: LightCacheQuality) -> Option<SampledLight> {
        let tests = LookUpTests::new(quality)?;
        let mut found = Findings {
            light: WeightedLight::default(),
            coverage: 0.0,
            least_luminance: f32::MAX,
            greatest_luminance: 0.0,
            camera_mask: 0,
        };
        for number in 0..self.images.len() {
            self.consult(number, point, &tests, &mut found);
        }
        let Findings { light, coverage, least_luminance, greatest_luminance, camera_mask } = found;
        let difference = greatest_luminance - least_luminance;
        let agrees = difference <= tests.most_difference * greatest_luminance.max(LEAST_LUMINANCE);
        (light.weight > 0.0).then(|| SampledLight {
            lamps_linear: light.lamps_linear / light.weight,
            environment_linear: light.environment_linear / light.weight,
            camera_mask,
            is_known: coverage >= tests.least_coverage && agrees,
        })
    }

    /// What the four texels around a point's place in an image say of it.
    fn consult(&self, number: usize, point: &SurfacePoint, tests: &LookUpTests, found: &mut Findings) {
        let image = &self.images[number];
        let camera = image.camera.pinhole().expect("a pinhole");
        let Some(place) = camera.project(point.point_in_world).filter(|place| place.planar_depth_m > camera.near_m)
        else {
            return;
        };
        let from_border = place.pixel.min(camera.size_px.as_vec2() - place.pixel).min_element();
        let border = (from_border / BORDER_PX).clamp(0.0, 1.0);
        if border <= 0.0 {
            return;
        }
        let low = (place.pixel - 0.5).floor();
        let share = place.pixel - 0.5 - low;
        let texel_m = place.planar_depth_m / camera.focal_px.min_element();
        let towards_camera = (camera.eye_in_world - point.point_in_world).normalize_or_zero();
        let facing = point.triangle_normal_in_world.dot(towards_camera).max(0.0);
        let closeness = border * (facing + GRAZING_SHARE) / (texel_m * texel_m);
        let tolerance = Tolerance {
            plane_m: tests.plane_footprints * texel_m.max(point.footprint_m),
            half_step: half_step_per_m(image) * place.planar_depth_m,
            least_cosine: tests.least_cosine,
        };
        let mut own = WeightedLight::default();
        let mut coverage = 0.0;
        for step in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE] {
            let weight = ((1.0 - step) * (1.0 - share) + step * share).to_array();
            let weight = weight[0] * weight[1];
            let texel = low + step;
            let inside = texel.min_element() >= 0.0 && texel.cmplt(camera.size_px.as_vec2()).all();
            if inside && weight > 0.0 && is_same_surface(image, texel.as_uvec2(), point, &tolerance) {
                coverage += weight;
                let light = self.light_of_texel(image, texel.as_uvec2(), point);
                own.add(&light, weight * closeness);
                if weight > LEAST_WEIGHT {
                    let total = luminance(light.lamps_linear + light.environment_linear);
                    found.least_luminance = found.least_luminance.min(total);
                    found.greatest_luminance = found.greatest_luminance.max(total);
                }
            }
        }
        if coverage > 0.0 {
            found.light.add(&own, coverage * coverage);
            found.coverage = found.coverage.max(coverage);
            found.camera_mask |= 1 << number;
        }
    }

    /// The light of a texel, as it would be with the point's own normal.
    fn light_of_texel(&self, image: &DepthImage, texel: UVec2, point: &SurfacePoint) -> WeightedLight {
        let place = (texel.y * image.size_px().x + texel.x) as usize;
        let light = image.light.as_ref().expect("light");
        let normal = unit_from_oct16(image.normal_oct16.as_ref().expect("normals")[place]);
        let mut lamps_linear = linear_from_rgb9e5(light.lamps_rgb9e5[place]);
        let mut environment_linear = linear_from_rgb9e5(light.environment_rgb9e5[place]);
        if normal.dot(point.normal_in_world) < SAME_NORMAL {
            let normals = [point.normal_in_world, normal];
            let [here, there] = normals.map(|n| self.expected_of_lamps(light, place, point.point_in_world, n));
            lamps_linear *= ratio(here, there);
            let [here, there] = normals.map(|n| luminance(self.illumination.environment.diffuse_linear(n)));
            if there > 0.0 {
                environment_linear *= ratio(here, there);
            }
        }
        WeightedLight { lamps_linear, environment_linear, weight: 1.0 }
    }

    /// The light that lamps would bring to a surface with the shares of a texel. Lamps without a share of their own have one
    /// together, and one direction.
    fn expected_of_lamps(&self, light: &LightPlanes, place: usize, point: Vec3, normal: Vec3) -> f32 {
        let named = self.illumination.lamps_with_shares();
        let mut expected = 0.0;
        let mut others = Vec3::ZERO;
        for (number, lamp) in (0..).zip(&self.illumination.lights) {
            let incident = lamp.from_middle(point);
            let vector = incident.towards_light_in_world * luminance(incident.irradiance_linear);
            match named.iter().position(|&lamp| lamp == number) {
                Some(named) => expected += vector.dot(normal).max(0.0) * share_of(light, place, named + 1),
                None => others += vector,
            }
        }
        expected + others.dot(normal).max(0.0) * share_of(light, place, MAX_LAMP_SHARES + 1)
    }
}

/// How near a texel of an image must be.
struct Tolerance {
    plane_m: f32,
    /// Half a step of the stored inverse depth times the depth of the point.
    half_step: f32,
    least_cosine: f32,
}

/// Whether a texel lies on the surface of a point.
fn is_same_surface(image: &DepthImage, texel: UVec2, point: &SurfacePoint, tolerance: &Tolerance) -> bool {
    let place = (texel.y * image.size_px().x + texel.x) as usize;
    let inverse_depth_per_m = image.inverse_depth_per_m[place];
    if inverse_depth_per_m <= 0.0 {
        return false;
    }
    let normal = unit_from_oct16(image.light.as_ref().expect("light").triangle_normal_oct16[place]);
    let center = PixelDepth { pixel: texel.as_vec2() + 0.5, planar_depth_m: inverse_depth_per_m.recip() };
    let texel_in_world = image.camera.unproject(center);
    let between = point.point_in_world - texel_in_world;
    // What half a step of the depth moves the texel by.
    let step = (texel_in_world - image.camera.reference().eye_in_world) * tolerance.half_step;
    let is_turned_alike = normal.dot(point.triangle_normal_in_world) >= tolerance.least_cosine;
    let mut normals = [normal, point.triangle_normal_in_world].into_iter();
    is_turned_alike && normals.all(|n| between.dot(n).abs() <= tolerance.plane_m + step.dot(n).abs())
}

/// Half a step of the stored inverse depth.
fn half_step_per_m(image: &DepthImage) -> f32 {
    let range = image.inverse_depth_range().map_or(0.0, |(least, greatest)| greatest - least);
    0.5 * range / DEPTH_CODES
}

fn luminance(linear: Vec3) -> f32 {
    linear.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

fn ratio(here: f32, there: f32) -> f32 {
    (here / there.max(1e-6)).clamp(0.0, MOST_RATIO)
}

fn share_of(light: &LightPlanes, place: usize, number: usize) -> f32 {
    let bytes = light.share8.get(number / 4).map(|plane| plane[place].to_le_bytes());
    bytes.map_or(1.0, |bytes| f32::from(bytes[number % 4]) / 255.0)
}
