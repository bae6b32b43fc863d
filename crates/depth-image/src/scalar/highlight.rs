//! View-dependent light: the scalar reference of highlight.wgsl.
//!
//! Intensities are those of [`Illumination`]: the reflectance's 1/π is part of the unit. Distribution functions are
//! therefore without the π of their denominator.

use std::f32::consts::PI;

use glam::{Vec3, Vec4};

use super::Incident;
use crate::{
    EnvironmentLight, EnvironmentMap, Highlight, Illumination, Light, ROUGHEST_MIRROR, Reflector, highlight::EXPONENTS,
    linear_from_srgb8,
};

/// A point that reflects towards an eye.
#[derive(Debug, Clone, Copy)]
struct Mirror {
    point_in_world: Vec3,
    normal_in_world: Vec3,
    towards_eye_in_world: Vec3,
    reflector: Reflector,
}

/// Lower bound of the roughness, which keeps the peak of a highlight finite. A lamp without extent has a peak of at
/// most 1/(4 · 0.045⁴), some 60,000.
const LEAST_ROUGHNESS: f32 = 0.045;
const LEAST_COSINE: f32 = 1e-4;
/// Up to the first roughness a ray brings all that a surface mirrors; from the second on, nothing.
const MIRROR_ROUGHNESS: [f32; 2] = [0.1, ROUGHEST_MIRROR];

impl Reflector {
    /// The inverse of [`Reflector::pack`]; `None` for 0.
    #[must_use]
    pub fn unpack(word: u32) -> Option<Self> {
        let [r, g, b, roughness] = word.to_le_bytes();
        (word != 0).then(|| Self {
            reflectance_linear: Vec3::from([r, g, b].map(linear_from_srgb8)),
            roughness: f32::from(roughness) / 255.0,
        })
    }

    /// The inverse of [`Reflector::roughness_of_exponent`].
    #[must_use]
    pub fn phong_exponent(&self) -> f32 {
        (2.0 / self.roughness.powi(4).max(1e-6) - 2.0).clamp(EXPONENTS[0], EXPONENTS[1])
    }

    /// The share of the mirror direction's light that a ray brings, where lighting follows rays from mirrors; the rest is
    /// the environment's.
    #[must_use]
    pub fn mirror_share(&self) -> f32 {
        let [all, none] = MIRROR_ROUGHNESS;
        ((none - self.roughness) / (none - all)).clamp(0.0, 1.0)
    }

    fn alpha(&self) -> f32 {
        let perceptual = self.roughness.max(LEAST_ROUGHNESS);
        perceptual * perceptual
    }
}

/// The view-dependent light of a surface for one eye, beside its diffuse light. `visibility` gives the arriving share
/// of the environment (0) and of the i-th light (1 + i). The two directions are unit vectors.
#[must_use]
pub fn highlight_linear(
    kind: Highlight,
    illumination: &Illumination,
    visibility: &dyn Fn(usize) -> f32,
    point_in_world: Vec3,
    normal_in_world: Vec3,
    towards_eye_in_world: Vec3,
    reflector: &Reflector,
) -> Vec3 {
    let mirror = Mirror { point_in_world, normal_in_world, towards_eye_in_world, reflector: *reflector };
    let lamps: Vec3 =
        (1..).zip(&illumination.lights).map(|(place, light)| mirror.lamp(kind, light) * visibility(place)).sum();
    match kind {
        Highlight::BlinnPhong => lamps,
        Highlight::Ggx => {
            let reflected = mirror.environment(|mirrored, roughness| {
                illumination.environment.radiance_linear(mirrored * contrast(roughness))
            });
            lamps + reflected * visibility(0)
        }
    }
}

/// The share of the light of the mirror direction that a surface reflects under GGX: the surface's part of the split sum.
/// The two directions are unit vectors.
#[must_use]
pub fn environment_reflectance_linear(
    normal_in_world: Vec3,
    towards_eye_in_world: Vec3,
    reflector: &Reflector,
) -> Vec3 {
    let point_in_world = Vec3::ZERO;
    Mirror { point_in_world, normal_in_world, towards_eye_in_world, reflector: *reflector }
        .environment(|_, _| Vec3::ONE)
}

/// The highlight of an unoccluded environment map under GGX. The two directions are unit vectors.
#[must_use]
pub fn environment_highlight_linear(
    light: &EnvironmentLight,
    map: &EnvironmentMap,
    normal_in_world: Vec3,
    towards_eye_in_world: Vec3,
    reflector: &Reflector,
) -> Vec3 {
    let point_in_world = Vec3::ZERO;
    let mirror = Mirror { point_in_world, normal_in_world, towards_eye_in_world, reflector: *reflector };
    mirror.environment(|mirrored, roughness| light.mirrored_linear(map, mirrored, roughness))
}

impl Mirror {
    /// The highlight of an unoccluded lamp.
    fn lamp(&self, kind: Highlight, light: &Light) -> Vec3 {
        let incident = light.from_middle(self.point_in_world);
        let half_way = (incident.towards_light_in_world + self.towards_eye_in_world).normalize_or_zero();
        let n_l = self.normal_in_world.dot(incident.towards_light_in_world).max(0.0);
        let reflected = match kind {
            Highlight::BlinnPhong => self.blinn_phong(half_way),
            Highlight::Ggx => {
                // The extent of a light acts as additional roughness (Karis 2013).
                let alpha = (self.reflector.alpha() + 0.5 * apparent_radius(light, &incident)).min(1.0);
                self.ggx(half_way, n_l, alpha)
            }
        };
        incident.irradiance_linear * reflected * n_l
    }

    fn blinn_phong(&self, half_way: Vec3) -> Vec3 {
        let lobe = self.normal_in_world.dot(half_way).max(0.0).powf(self.reflector.phong_exponent());
        self.reflector.reflectance_linear * lobe
    }

    /// The reflected share, times π.
    fn ggx(&self, half_way: Vec3, n_l: f32, alpha: f32) -> Vec3 {
        let n_v = self.normal_in_world.dot(self.towards_eye_in_world).max(LEAST_COSINE);
        let lobe = ggx_distribution(self.normal_in_world, half_way, alpha) * ggx_visibility(n_l, n_v, alpha);
        schlick(self.reflector.reflectance_linear, self.towards_eye_in_world.dot(half_way).max(0.0)) * lobe
    }

    /// The highlight of the unoccluded environment: split sum, with Karis' fit for the surface's part
    /// ("Physically Based Shading on Mobile", 2014). `mirrored_linear` is the mean radiance over a lobe, by its middle and
    /// the surface's roughness.
    fn environment(&self, mirrored_linear: impl FnOnce(Vec3, f32) -> Vec3) -> Vec3 {
        let n_v = self.normal_in_world.dot(self.towards_eye_in_world).clamp(0.0, 1.0);
        let roughness = self.reflector.roughness.max(LEAST_ROUGHNESS);
        let r = Vec4::new(-1.0, -0.0275, -0.572, 0.022) * roughness + Vec4::new(1.0, 0.0425, 1.04, -0.04);
        let grazing = (r.x * r.x).min((-9.28 * n_v).exp2()) * r.x + r.y;
        let brdf = self.reflector.reflectance_linear * (r.z - 1.04 * grazing) + (r.w + 1.04 * grazing);
        let mirrored = -self.towards_eye_in_world.reflect(self.normal_in_world);
        mirrored_linear(mirrored, roughness) * brdf
    }
}

/// The share of the environment's gradient that remains after averaging over a rough surface's lobe. It is 2/3 for
/// the roughest, as for white paint, and within 0.03 of the integral.
fn contrast(roughness: f32) -> f32 {
    let alpha = roughness * roughness;
    1.0 - alpha * (0.5 - alpha / 6.0)
}

/// The tangent of half the angular diameter of a light, as if it were round.
fn apparent_radius(light: &Light, incident: &Incident) -> f32 {
    match *light {
        Light::Directional { angular_radius_rad, .. } => angular_radius_rad.tan(),
        Light::Point { radius_m, .. } | Light::Spot { radius_m, .. } => radius_m / incident.distance_m,
        Light::Rectangle { half_edges_in_world: [u, v], .. } => {
            let seen_area_m2 = -4.0 * u.cross(v).dot(incident.towards_light_in_world);
            (seen_area_m2.max(0.0) / PI).sqrt() / incident.distance_m
        }
    }
}

/// Trowbridge-Reitz, times π; 0 for a zero half-way vector. The sine keeps precision where the cosine is almost 1.
fn ggx_distribution(normal: Vec3, half_way: Vec3, alpha: f32) -> f32 {
    let cosine = normal.dot(half_way).max(0.0);
    let squared = alpha * alpha;
    let spread = (normal.cross(half_way).length_squared() + cosine * cosine * squared).max(squared);
    half_way.length_squared() * squared / (spread * spread)
}

/// Height-correlated Smith masking and shadowing (Heitz 2014), over 4 · n·l · n·v.
fn ggx_visibility(n_l: f32, n_v: f32, alpha: f32) -> f32 {
    let squared = alpha * alpha;
    let from_eye = n_l * (n_v * n_v * (1.0 - squared) + squared).sqrt();
    let from_light = n_v * (n_l * n_l * (1.0 - squared) + squared).sqrt();
    0.5 / (from_eye + from_light).max(1e-12)
}

fn schlick(reflectance_linear: Vec3, cosine: f32) -> Vec3 {
    reflectance_linear + (1.0 - reflectance_linear) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Environment;

    const POLISHED_TO_ROUGH: [f32; 6] = [0.1, 0.2, 0.35, 0.5, 0.75, 1.0];
    const TILTS_RAD: [f32; 5] = [0.0, 0.4, 0.8, 1.2, 1.5];

    fn white(roughness: f32) -> Reflector {
        Reflector { reflectance_linear: Vec3::ONE, roughness }
    }

    fn tilted(angle_rad: f32, around_rad: f32) -> Vec3 {
        Vec3::new(angle_rad.sin() * around_rad.cos(), angle_rad.cos(), angle_rad.sin() * around_rad.sin())
    }

    /// The red light of a level surface under parallel light of irradiance 1.
    fn reflected(kind: Highlight, reflector: &Reflector, towards_light: Vec3, towards_eye: Vec3) -> f32 {
        let sun = Light::Directional {
            towards_light_in_world: towards_light,
            irradiance_linear: Vec3::ONE,
            angular_radius_rad: 0.0,
        };
        let illumination = Illumination { lights: vec![sun], ..Illumination::default() };
        highlight_linear(kind, &illumination, &|_| 1.0, Vec3::ZERO, Vec3::Y, towards_eye, reflector).x
    }

    /// Directions over the upper hemisphere with their solid angles, densest at the zenith.
    fn hemisphere() -> impl Iterator<Item = (Vec3, f32)> {
        const RINGS: usize = 600;
        const SPOKES: usize = 600;
        (0..RINGS * SPOKES).map(|i| {
            let u = ((i / SPOKES) as f32 + 0.5) / RINGS as f32;
            let solid = 6.0 * PI * u * u / (RINGS * SPOKES) as f32;
            let around = ((i % SPOKES) as f32 + 0.5) * 2.0 * PI / SPOKES as f32;
            (tilted((1.0 - u * u * u).acos(), around), solid)
        })
    }

    #[test]
    fn a_reflector_round_trips_and_black_packs_to_zero() {
        assert_eq!(Reflector::unpack(0), None);
        let black = Reflector { reflectance_linear: Vec3::ZERO, roughness: 0.5 };
        assert_eq!(black.pack(), 0);
        for roughness in [0.0, 0.3, 1.0] {
            let reflector = Reflector { reflectance_linear: Vec3::new(0.04, 0.5, 1.0), roughness };
            let word = reflector.pack();
            let back = Reflector::unpack(word).expect("a reflector");
            assert_eq!(back.pack(), word);
            assert!((back.reflectance_linear - reflector.reflectance_linear).abs().max_element() < 5e-3);
            assert!((back.roughness - roughness).abs() < 3e-3);
        }
        let nonsense = Reflector { reflectance_linear: Vec3::NAN, roughness: f32::NAN };
        assert_eq!(nonsense.pack(), 0);
    }

    #[test]
    fn exponents_round_trip() {
        for exponent in [1.0, 8.0, 32.0, 200.0, 1024.0] {
            let reflector = white(Reflector::roughness_of_exponent(exponent));
            assert!((reflector.phong_exponent() / exponent - 1.0).abs() < 1e-3, "{exponent}");
        }
        assert_eq!(white(0.0).phong_exponent(), 1024.0);
        assert_eq!(white(1.0).phong_exponent(), 1.0);
    }

    #[test]
    fn blinn_phong_equals_its_closed_form() {
        let towards_light = tilted(0.5, 0.3);
        let towards_eye = tilted(0.7, 2.9);
        let reflector = Reflector { reflectance_linear: Vec3::splat(0.4), roughness: 0.5 };
        let half_way = (towards_light + towards_eye).normalize_or_zero();
        let expected = 0.4 * towards_light.y * half_way.y.powf(30.0);
        let found = reflected(Highlight::BlinnPhong, &reflector, towards_light, towards_eye);
        assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
    }

    #[test]
    fn the_microfacet_distribution_integrates_to_one() {
        for roughness in POLISHED_TO_ROUGH {
            let alpha = white(roughness).alpha();
            let sum: f64 =
                hemisphere().map(|(h, solid)| f64::from(ggx_distribution(Vec3::Y, h, alpha) * h.y * solid / PI)).sum();
            assert!((sum - 1.0).abs() < 0.02, "roughness {roughness}: {sum}");
        }
    }

    #[test]
    fn a_lobe_reflects_at_most_the_arriving_light() {
        for roughness in POLISHED_TO_ROUGH.into_iter().skip(1) {
            for tilt in TILTS_RAD {
                let eye = tilted(tilt, 0.0);
                // A light of radiance 1 gives irradiance solid / π, in units that white paint reflects.
                let lit = |(light, solid): (Vec3, f32)| {
                    f64::from(reflected(Highlight::Ggx, &white(roughness), light, eye) * solid / PI)
                };
                let sum: f64 = hemisphere().map(lit).sum();
                assert!(sum <= 1.02 && sum > 0.3, "roughness {roughness}, tilt {tilt}: {sum}");
            }
        }
    }

    #[test]
    fn the_environment_reflects_at_most_its_light() {
        let illumination = Illumination { lights: vec![], environment: Environment::uniform(Vec3::ONE) };
        for roughness in POLISHED_TO_ROUGH {
            for tilt in TILTS_RAD {
                let at = |share: f32| {
                    let eye = tilted(tilt, 0.0);
                    highlight_linear(
                        Highlight::Ggx,
                        &illumination,
                        &|_| share,
                        Vec3::ZERO,
                        Vec3::Y,
                        eye,
                        &white(roughness),
                    )
                };
                assert!(at(1.0).x <= 1.02 && at(1.0).x > 0.3, "roughness {roughness}, tilt {tilt}: {}", at(1.0));
                assert_eq!(at(0.0), Vec3::ZERO);
            }
        }
    }

    #[test]
    fn the_contrast_is_within_a_bound_of_the_integral() {
        for roughness in [0.2f32, 0.4, 0.6, 0.8, 1.0] {
            let alpha = roughness * roughness;
            let mut sum = 0.0f64;
            let mut weights = 0.0f64;
            for (half_way, solid) in hemisphere() {
                let towards = 2.0 * half_way.y * half_way - Vec3::Y;
                let weight = ggx_distribution(Vec3::Y, half_way, alpha) * half_way.y * solid * towards.y.max(0.0);
                weights += f64::from(weight);
                sum += f64::from(weight * towards.y);
            }
            let expected = (sum / weights) as f32;
            assert!((contrast(roughness) - expected).abs() < 0.03, "{roughness}: {} {expected}", contrast(roughness));
        }
    }

    #[test]
    fn ggx_is_reciprocal() {
        for roughness in POLISHED_TO_ROUGH {
            let a = tilted(0.4, 0.2);
            let b = tilted(1.1, 2.0);
            let there = reflected(Highlight::Ggx, &white(roughness), a, b) / a.y;
            let back = reflected(Highlight::Ggx, &white(roughness), b, a) / b.y;
            assert!((there / back - 1.0).abs() < 1e-4, "roughness {roughness}: {there} {back}");
        }
    }

    #[test]
    fn the_mirror_direction_is_the_brightest() {
        for kind in [Highlight::BlinnPhong, Highlight::Ggx] {
            let sun = tilted(0.5, 0.0);
            let at = |tilt: f32| reflected(kind, &white(0.3), sun, tilted(tilt, PI));
            let brightest = (0..1500).map(|i| i as f32 * 1e-3).max_by(|a, b| at(*a).total_cmp(&at(*b)));
            assert!(brightest.is_some_and(|tilt| (tilt - 0.5).abs() < 0.03), "{kind:?}: {brightest:?}");
            let aside = reflected(kind, &white(0.3), sun, tilted(0.5, 2.5));
            assert!(aside < at(0.5), "{kind:?}");
        }
    }

    #[test]
    fn the_peak_rises_with_smoothness_and_stays_finite() {
        let sun = tilted(0.5, 0.0);
        let peaks: Vec<f32> =
            (0..=100).map(|i| reflected(Highlight::Ggx, &white(1.0 - i as f32 * 0.01), sun, tilted(0.5, PI))).collect();
        assert!(peaks.iter().all(|peak| peak.is_finite() && *peak > 0.0));
        assert!(peaks.is_sorted(), "{peaks:?}");
        assert!(peaks[100] < 7e4, "{}", peaks[100]);
    }

    #[test]
    fn a_lamps_extent_widens_its_highlight() {
        let lamp = |radius_m| Light::Point { position_in_world: Vec3::Y * 2.0, intensity_linear: Vec3::ONE, radius_m };
        let at = |radius_m, eye| {
            let illumination = Illumination { lights: vec![lamp(radius_m)], ..Illumination::default() };
            highlight_linear(Highlight::Ggx, &illumination, &|_| 1.0, Vec3::ZERO, Vec3::Y, eye, &white(0.2)).x
        };
        assert!(at(0.2, Vec3::Y) < at(0.0, Vec3::Y), "a wide light has no sharp peak");
        assert!(at(0.2, tilted(0.4, 0.0)) > at(0.0, tilted(0.4, 0.0)), "but is seen farther aside");
        // A square of the same area, seen from its front, has the same apparent radius.
        let half = PI.sqrt() / 2.0 * 0.2;
        let square = Light::Rectangle {
            center_in_world: Vec3::Y * 2.0,
            half_edges_in_world: [Vec3::X * half, Vec3::Z * half],
            radiance_linear: Vec3::ONE,
        };
        let incident = square.from_middle(Vec3::ZERO);
        assert!((apparent_radius(&square, &incident) - 0.1).abs() < 1e-6);
    }

    #[test]
    fn a_highlight_scales_with_the_lamps_visibility() {
        let sun = |x: f32| Light::Directional {
            towards_light_in_world: tilted(0.3 * x, 0.0),
            irradiance_linear: Vec3::splat(x),
            angular_radius_rad: 0.0,
        };
        let illumination = Illumination { lights: vec![sun(1.0), sun(2.0)], ..Illumination::default() };
        for kind in [Highlight::BlinnPhong, Highlight::Ggx] {
            let with = |visibility: [f32; 3]| {
                let share = move |place: usize| visibility[place];
                highlight_linear(kind, &illumination, &share, Vec3::ZERO, Vec3::Y, Vec3::Y, &white(0.5)).x
            };
            let [first, second] = [with([1.0, 1.0, 0.0]), with([1.0, 0.0, 1.0])];
            assert!(first > 0.0 && second > 0.0, "{kind:?}");
            assert!((with([1.0, 0.5, 1.0]) - (0.5 * first + second)).abs() < 1e-5, "{kind:?}");
        }
    }

    #[test]
    fn a_highlight_is_finite_at_the_back_and_inside_a_light() {
        let lamp = Light::Point { position_in_world: Vec3::ZERO, intensity_linear: Vec3::ONE, radius_m: 0.1 };
        let plate = Light::Rectangle {
            center_in_world: Vec3::ZERO,
            half_edges_in_world: [Vec3::X, Vec3::Z],
            radiance_linear: Vec3::ONE,
        };
        let environment = Environment::uniform(Vec3::ONE);
        let illumination = Illumination { lights: vec![lamp, plate], environment };
        let directions = [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::ZERO, tilted(PI / 2.0, 1.0)];
        for (normal, eye) in directions.into_iter().flat_map(|n| directions.map(|e| (n, e))) {
            for kind in [Highlight::BlinnPhong, Highlight::Ggx] {
                for point in [Vec3::ZERO, Vec3::NEG_Y, Vec3::splat(1e6)] {
                    let added = highlight_linear(kind, &illumination, &|_| 1.0, point, normal, eye, &white(0.0));
                    assert!(added.is_finite() && added.min_element() >= 0.0, "{kind:?} {normal} {eye}: {added}");
                }
            }
        }
    }
}
