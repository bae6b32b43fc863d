//! Light of an environment map: the scalar reference of environment.wgsl.

use std::f32::consts::{PI, TAU};

use glam::{IVec2, Vec2, Vec3};

use super::Incident;
use crate::environment_light::base_of;
use crate::environment_map::direction_at;
use crate::{EnvironmentLight, EnvironmentMap, LOBE_ROUGHNESS, LOBE_SIZE_PX, Lobe, linear_from_rgb9e5};

impl EnvironmentMap {
    /// Radiance that arrives from a direction, a unit vector, interpolated between texels.
    #[must_use]
    pub fn radiance_linear(&self, towards_in_world: Vec3) -> Vec3 {
        bilinear(share_of(towards_in_world), self.size_px().as_ivec2(), |column, row| self.texel_linear(column, row))
    }
}

impl EnvironmentLight {
    /// Radiance of the base, of the texel in a direction.
    #[must_use]
    pub fn base_linear(&self, map: &EnvironmentMap, towards_in_world: Vec3) -> Vec3 {
        let size_px = map.size_px();
        let texel = (share_of(towards_in_world) * size_px.as_vec2()).as_uvec2().min(size_px - 1);
        base_of(map.texel_linear(texel.x, texel.y), self.base_limit)
    }

    /// The mean over a lobe around a direction.
    #[must_use]
    pub fn lobe_linear(&self, lobe: Lobe, middle_in_world: Vec3) -> Vec3 {
        let first = lobe.index() * LOBE_SIZE_PX.element_product() as usize;
        bilinear(share_of(middle_in_world), LOBE_SIZE_PX.as_ivec2(), |column, row| {
            Vec3::from_slice(&self.lobes[first + (row * LOBE_SIZE_PX.x + column) as usize][..3])
        })
    }

    /// The map as a surface of some roughness mirrors it.
    #[must_use]
    pub fn mirrored_linear(&self, map: &EnvironmentMap, mirrored_in_world: Vec3, roughness: f32) -> Vec3 {
        let level = LOBE_ROUGHNESS.iter().position(|&rougher| roughness <= rougher).unwrap_or(LOBE_ROUGHNESS.len() - 1);
        let rough = self.lobe_linear(Lobe::Mirror(level), mirrored_in_world);
        let (smooth, least) = match level.checked_sub(1) {
            None => (map.radiance_linear(mirrored_in_world), 0.0),
            Some(smoother) => (self.lobe_linear(Lobe::Mirror(smoother), mirrored_in_world), LOBE_ROUGHNESS[smoother]),
        };
        smooth.lerp(rough, ((roughness - least) / (LOBE_ROUGHNESS[level] - least)).clamp(0.0, 1.0))
    }

    /// Light from one point of the bright texels; `None` without any. Its mean over `place` in the unit square is that
    /// of all.
    #[must_use]
    pub fn bright_incident(&self, map: &EnvironmentMap, place: Vec2) -> Option<Incident> {
        let at = self.bright_texels.partition_point(|texel| texel.cumulated_share <= place.x);
        let texel = self.bright_texels.get(at.min(self.bright_texels.len().saturating_sub(1)))?;
        let before = at.checked_sub(1).map_or(0.0, |before| self.bright_texels[before].cumulated_share);
        let along = ((place.x - before) / (texel.cumulated_share - before).max(1e-9)).clamp(0.0, 1.0);
        // Equal steps of the height's cosine are equal solid angles.
        let size = map.size_px().as_vec2();
        let [column, row] = [texel.place & 0xffff, texel.place >> 16].map(|half| half as f32);
        let [top, bottom] = [row, row + 1.0].map(|edge| (PI * edge / size.y).cos());
        let down = (top + (bottom - top) * place.y).clamp(-1.0, 1.0).acos() / PI;
        Some(Incident {
            towards_light_in_world: direction_at(Vec2::new((column + along) / size.x, down)),
            distance_m: f32::INFINITY,
            irradiance_linear: linear_from_rgb9e5(texel.chroma_rgb9e5) * self.bright_irradiance,
        })
    }
}

/// The place of a direction in a map, in shares of its width and height.
fn share_of(towards_in_world: Vec3) -> Vec2 {
    let east = towards_in_world.x.atan2(-towards_in_world.z) / TAU;
    Vec2::new(0.5 + east, towards_in_world.y.clamp(-1.0, 1.0).acos() / PI)
}

/// Rows wrap around; columns end at the poles.
fn bilinear(share: Vec2, size_px: IVec2, texel: impl Fn(u32, u32) -> Vec3) -> Vec3 {
    let place = share * size_px.as_vec2() - 0.5;
    let first = place.floor().as_ivec2();
    let at = place - place.floor();
    let texel = |x: i32, y: i32| {
        texel((first.x + x).rem_euclid(size_px.x) as u32, (first.y + y).clamp(0, size_px.y - 1) as u32)
    };
    texel(0, 0).lerp(texel(1, 0), at.x).lerp(texel(0, 1).lerp(texel(1, 1), at.x), at.y)
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;
    use crate::Environment;

    const SIZE_PX: UVec2 = UVec2::new(64, 32);

    fn map(radiance: impl Fn(Vec3, UVec2) -> Vec3) -> EnvironmentMap {
        let places = (0..SIZE_PX.y).flat_map(|y| (0..SIZE_PX.x).map(move |x| UVec2::new(x, y)));
        let towards = |place: UVec2| direction_at((place.as_vec2() + 0.5) / SIZE_PX.as_vec2());
        let radiances: Vec<Vec3> = places.map(|place| radiance(towards(place), place)).collect();
        EnvironmentMap::new(SIZE_PX, &radiances).unwrap()
    }

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..500).map(|i| direction_at(Vec2::new((i as f32 * 0.618).fract(), (i as f32 + 0.5) / 500.0)))
    }

    fn lobes() -> Vec<Lobe> {
        (0..LOBE_ROUGHNESS.len()).map(Lobe::Mirror).chain([Lobe::Diffuse, Lobe::DiffuseBase]).collect()
    }

    #[test]
    fn a_uniform_map_equals_its_radiance_everywhere() {
        let grey = Vec3::new(0.5, 0.25, 1.0);
        for scale in [1.0, 1.01] {
            let map = map(|_, place| if place == UVec2::new(20, 9) { grey * scale } else { grey });
            let light = EnvironmentLight::of(&map);
            assert!(light.bright_texels.is_empty() && light.bright_incident(&map, Vec2::ZERO).is_none());
            for towards in directions() {
                let close = |found: Vec3| (found / grey - 1.0).abs().max_element() < 1.02 * scale - 1.0;
                assert!(close(map.radiance_linear(towards)) && close(light.base_linear(&map, towards)));
                assert!(lobes().into_iter().all(|lobe| close(light.lobe_linear(lobe, towards))), "{towards}");
                assert!(close(light.mirrored_linear(&map, towards, 0.3)));
            }
        }
    }

    #[test]
    fn the_texel_in_a_direction_is_found() {
        let map = map(|_, place| Vec3::new(place.x as f32, place.y as f32, 1.0));
        for place in [UVec2::ZERO, UVec2::new(63, 31), UVec2::new(40, 7)] {
            let towards = direction_at((place.as_vec2() + 0.5) / SIZE_PX.as_vec2());
            assert!(map.radiance_linear(towards).distance(place.as_vec2().extend(1.0)) < 2e-3);
        }
    }

    #[test]
    fn a_gradients_diffuse_light_equals_the_closed_form() {
        let gradient = Environment::gradient(Vec3::new(0.9, 0.5, 0.3), Vec3::splat(0.1));
        let light = EnvironmentLight::of(&map(|towards, _| gradient.radiance_linear(towards)));
        for normal in directions() {
            for lobe in [Lobe::Diffuse, Lobe::DiffuseBase] {
                let found = light.lobe_linear(lobe, normal);
                let expected = gradient.diffuse_linear(normal);
                assert!((found / expected - 1.0).abs().max_element() < 0.01, "{normal}: {found} {expected}");
            }
        }
    }

    #[test]
    fn base_and_bright_texels_together_are_the_map() {
        let suns = [UVec2::new(20, 5), UVec2::new(21, 5), UVec2::new(50, 9)];
        let sky = Vec3::new(0.2, 0.3, 0.5);
        let map = map(|_, place| if suns.contains(&place) { Vec3::new(900.0, 800.0, 600.0) } else { sky });
        let light = EnvironmentLight::of(&map);
        assert_eq!(light.bright_texels.len(), suns.len());
        for normal in directions() {
            const SIDE: usize = 64;
            let places =
                (0..SIDE * SIDE).map(|i| (Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32);
            let sum: Vec3 = places
                .filter_map(|place| light.bright_incident(&map, place))
                .map(|light| light.irradiance_linear * normal.dot(light.towards_light_in_world).max(0.0))
                .sum();
            let found = sum / (SIDE * SIDE) as f32 + light.lobe_linear(Lobe::DiffuseBase, normal);
            let whole = light.lobe_linear(Lobe::Diffuse, normal);
            assert!((found - whole).abs().max_element() < 0.02 * light.bright_irradiance, "{normal}: {found} {whole}");
        }
    }

    #[test]
    fn bright_texels_take_points_in_proportion_to_their_power() {
        // Three parts of the power in one texel, a part in the other, both of one row.
        let map = map(|_, place| match place {
            UVec2 { x: 10, y: 15 } => Vec3::splat(30_000.0),
            UVec2 { x: 40, y: 15 } => Vec3::splat(10_000.0),
            _ => Vec3::ZERO,
        });
        let light = EnvironmentLight::of(&map);
        let east = (0..16).filter(|i| {
            let place = Vec2::new((*i as f32 + 0.5) / 16.0, 0.5);
            light.bright_incident(&map, place).is_some_and(|incident| incident.towards_light_in_world.x > 0.0)
        });
        let share = east.count();
        assert!((3..=4).contains(&share), "{share} of 16 points");
    }

    #[test]
    fn a_mirrored_sun_is_wider_on_rougher_surfaces() {
        let map = map(|_, place| if place == UVec2::new(32, 16) { Vec3::splat(1000.0) } else { Vec3::ZERO });
        let light = EnvironmentLight::of(&map);
        let sun = direction_at((Vec2::new(32.5, 16.5)) / SIZE_PX.as_vec2());
        let peaks: Vec<f32> =
            [0.0, 0.2, 0.5, 1.0].map(|roughness| light.mirrored_linear(&map, sun, roughness).x).to_vec();
        assert!(peaks.is_sorted_by(|a, b| a > b) && peaks[3] > 0.0, "{peaks:?}");
    }
}
