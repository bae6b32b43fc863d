//! The twin of `cube/gather.wgsl`.

use depth_image::{LayeredLightField, LightDirection, PixelDepth, ROUGHEST_MIRROR, Reflector, linear_from_rgb9e5};
use glam::{Vec2, Vec3};

use crate::cube::{FOOTPRINT_SHARE, GpuLightField, LEAST_LOBE_SHARE, NEAREST_SPACINGS};

/// A surface that reflects towards an eye.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Reflecting {
    pub point_in_world: Vec3,
    pub normal_in_world: Vec3,
    pub towards_eye_in_world: Vec3,
    pub reflector: Reflector,
}

/// The mean light of a surface's lobe; `around` is what is seen where the scene ends.
#[must_use]
pub fn gathered_light(field: &LayeredLightField, surface: &Reflecting, around: impl Fn(Vec3) -> Vec3) -> Vec3 {
    let lobe = Lobe::of(surface, GpuLightField::of(&field.camera));
    let mut light = Vec3::ZERO;
    let mut sum = 0.0;
    for (number, direction) in field.camera.directions.all().into_iter().enumerate() {
        let share = lobe.share(-direction.towards);
        if share > LEAST_LOBE_SHARE {
            let weight = share * direction.solid_angle_sr;
            let point_in_world = lobe.surface.point_in_world;
            light += light_through(field, number, direction, point_in_world, lobe.is_rough(), &around) * weight;
            sum += weight;
        }
    }
    if sum > 0.0 { light / sum } else { around(lobe.mirrored) }
}

struct Lobe {
    surface: Reflecting,
    mirrored: Vec3,
    exponent: f32,
    alpha: f32,
}

impl Lobe {
    fn of(surface: &Reflecting, field: GpuLightField) -> Self {
        let roughness = surface.reflector.roughness;
        Self {
            surface: *surface,
            mirrored: (-surface.towards_eye_in_world).reflect(surface.normal_in_world),
            exponent: field.exponent,
            alpha: (roughness * roughness).max(field.least_alpha),
        }
    }

    fn is_rough(&self) -> bool {
        self.surface.reflector.roughness >= ROUGHEST_MIRROR
    }

    /// How much of the light from a direction is reflected, beside that from the mirrored one.
    fn share(&self, towards_light: Vec3) -> f32 {
        let normal = self.surface.normal_in_world;
        if normal.dot(towards_light) <= 0.0 {
            return 0.0;
        }
        if !self.is_rough() {
            return self.mirrored.dot(towards_light).max(0.0).powf(self.exponent);
        }
        self.microfacets(towards_light) / self.microfacets(self.mirrored).max(1e-12)
    }

    /// Trowbridge-Reitz with height-correlated masking, times the cosine.
    fn microfacets(&self, towards_light: Vec3) -> f32 {
        let eye = self.surface.towards_eye_in_world;
        let normal = self.surface.normal_in_world;
        let squared = self.alpha * self.alpha;
        let half_way = (towards_light + eye).normalize_or_zero();
        let [n_l, n_v, n_h] = [towards_light, eye, half_way].map(|unit| normal.dot(unit).max(1e-4));
        let spread = n_h * n_h * (squared - 1.0) + 1.0;
        let [by_light, by_eye] = [(n_l, n_v), (n_v, n_l)].map(|(a, b)| a * (b * b * (1.0 - squared) + squared).sqrt());
        squared / (spread * spread) * 0.5 / (by_light + by_eye) * n_l
    }
}

/// The light that comes to a point from around a direction.
fn light_through(
    field: &LayeredLightField,
    number: usize,
    direction: LightDirection,
    point_in_world: Vec3,
    is_rough: bool,
    around: &impl Fn(Vec3) -> Vec3,
) -> Vec3 {
    let lines = field.camera.lines(direction.towards);
    let outside = PixelDepth { pixel: Vec2::ZERO, planar_depth_m: 0.0 };
    let PixelDepth { pixel, planar_depth_m } = lines.project(point_in_world).unwrap_or(outside);
    let own = DirectionLines {
        field,
        number,
        least_depth_m: planar_depth_m + NEAREST_SPACINGS * lines.spacing_m,
        around: around(-direction.towards),
    };
    if !is_rough {
        return own.light_between(pixel);
    }
    let behind_m = own.met(pixel).map_or(0.0, |sample| field.planar_depth_m[sample] - own.least_depth_m);
    let width_px = FOOTPRINT_SHARE * behind_m * direction.solid_angle_sr.sqrt() / lines.spacing_m;
    let halves = [Vec2::new(-0.5, -0.5), Vec2::new(0.5, -0.5), Vec2::new(-0.5, 0.5), Vec2::splat(0.5)];
    halves.into_iter().map(|offset| own.light_between(pixel + offset * width_px)).sum::<Vec3>() / 4.0
}

/// The lines of a direction behind a depth.
struct DirectionLines<'f> {
    field: &'f LayeredLightField,
    number: usize,
    least_depth_m: f32,
    around: Vec3,
}

impl DirectionLines<'_> {
    /// The first sample on the line at a place.
    fn met(&self, place: Vec2) -> Option<usize> {
        let side = self.field.camera.side_px;
        let at = place.clamp(Vec2::ZERO, Vec2::splat((side - 1) as f32)).as_uvec2();
        let line = ((self.number as u32 * side + at.y) * side + at.x) as usize;
        let mut samples = self.field.first[line] as usize..self.field.first[line + 1] as usize;
        samples.find(|&sample| self.field.planar_depth_m[sample] >= self.least_depth_m)
    }

    /// Beside the square the scene has nothing.
    fn light(&self, place: Vec2) -> Vec3 {
        let is_beside = place.min_element() < -1.0 || place.max_element() > self.field.camera.side_px as f32;
        let met = if is_beside { None } else { self.met(place) };
        met.map_or(self.around, |sample| linear_from_rgb9e5(self.field.radiance_rgb9e5[sample]))
    }

    /// Between the four lines around a place.
    fn light_between(&self, place: Vec2) -> Vec3 {
        let first = (place - 0.5).floor();
        let share = place - 0.5 - first;
        let [upper, lower] = [0.0, 1.0].map(|y| {
            let [left, right] = [0.0, 1.0].map(|x| self.light(first + Vec2::new(x, y)));
            left.lerp(right, share.x)
        });
        upper.lerp(lower, share.y)
    }
}
