//! Lamps and environments.

use cluster::{InvalidField, at_most};
use depth_image::{Environment, Illumination, Light, LightError, MAX_LIGHTS};

use super::geometry::{vec3_from, vec3_to};
use crate::error::required;
use crate::proto;
use crate::proto::light::Kind;

impl TryFrom<proto::Illumination> for Illumination {
    type Error = InvalidField;

    fn try_from(i: proto::Illumination) -> Result<Self, InvalidField> {
        at_most(i.lights.len(), MAX_LIGHTS, "illumination.lights")?;
        let lights = i.lights.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?;
        Ok(Self { lights, environment: required(i.environment, "illumination.environment")?.try_into()? })
    }
}

impl From<Illumination> for proto::Illumination {
    fn from(i: Illumination) -> Self {
        Self { lights: i.lights.into_iter().map(Into::into).collect(), environment: Some(i.environment.into()) }
    }
}

impl TryFrom<proto::Environment> for Environment {
    type Error = InvalidField;

    fn try_from(e: proto::Environment) -> Result<Self, InvalidField> {
        let environment = Self {
            zenith_linear: vec3_from(e.zenith_linear_rgb, "environment.zenith_linear_rgb")?,
            nadir_linear: vec3_from(e.nadir_linear_rgb, "environment.nadir_linear_rgb")?,
        };
        environment.validate().map_err(refused("illumination.environment"))?;
        Ok(environment)
    }
}

impl From<Environment> for proto::Environment {
    fn from(e: Environment) -> Self {
        Self { zenith_linear_rgb: vec3_to(e.zenith_linear), nadir_linear_rgb: vec3_to(e.nadir_linear) }
    }
}

fn refused(field: &'static str) -> impl Fn(LightError) -> InvalidField {
    move |source| InvalidField::Light { field, source }
}

impl TryFrom<proto::Light> for Light {
    type Error = InvalidField;

    fn try_from(l: proto::Light) -> Result<Self, InvalidField> {
        let (light, field) = match required(l.kind, "light.kind")? {
            Kind::Directional(light) => (directional_from(light)?, "light.directional"),
            Kind::Point(light) => (point_from(light)?, "light.point"),
            Kind::Spot(light) => (spot_from(light)?, "light.spot"),
            Kind::Rectangle(light) => (rectangle_from(light)?, "light.rectangle"),
        };
        light.validate().map_err(refused(field))?;
        Ok(light)
    }
}

fn directional_from(l: proto::DirectionalLight) -> Result<Light, InvalidField> {
    Ok(Light::Directional {
        towards_light_in_world: vec3_from(l.towards_light_in_world_unit, "light.towards_light_in_world_unit")?,
        irradiance_linear: vec3_from(l.irradiance_linear_rgb, "light.irradiance_linear_rgb")?,
        angular_radius_rad: l.angular_radius_rad,
    })
}

fn point_from(l: proto::PointLight) -> Result<Light, InvalidField> {
    Ok(Light::Point {
        position_in_world: vec3_from(l.position_in_world_m, "light.position_in_world_m")?,
        intensity_linear: vec3_from(l.intensity_linear_rgb, "light.intensity_linear_rgb")?,
        radius_m: l.radius_m,
    })
}

fn spot_from(l: proto::SpotLight) -> Result<Light, InvalidField> {
    Ok(Light::Spot {
        position_in_world: vec3_from(l.position_in_world_m, "light.position_in_world_m")?,
        forward_in_world: vec3_from(l.forward_in_world_unit, "light.forward_in_world_unit")?,
        intensity_linear: vec3_from(l.intensity_linear_rgb, "light.intensity_linear_rgb")?,
        inner_cone_rad: l.inner_cone_rad,
        outer_cone_rad: l.outer_cone_rad,
        radius_m: l.radius_m,
    })
}

fn rectangle_from(l: proto::RectangleLight) -> Result<Light, InvalidField> {
    Ok(Light::Rectangle {
        center_in_world: vec3_from(l.center_in_world_m, "light.center_in_world_m")?,
        half_edges_in_world: [
            vec3_from(l.first_half_edge_in_world_m, "light.first_half_edge_in_world_m")?,
            vec3_from(l.second_half_edge_in_world_m, "light.second_half_edge_in_world_m")?,
        ],
        radiance_linear: vec3_from(l.radiance_linear_rgb, "light.radiance_linear_rgb")?,
    })
}

impl From<Light> for proto::Light {
    fn from(light: Light) -> Self {
        let kind = match light {
            Light::Directional { towards_light_in_world, irradiance_linear, angular_radius_rad } => {
                Kind::Directional(proto::DirectionalLight {
                    towards_light_in_world_unit: vec3_to(towards_light_in_world),
                    irradiance_linear_rgb: vec3_to(irradiance_linear),
                    angular_radius_rad,
                })
            }
            Light::Point { position_in_world, intensity_linear, radius_m } => Kind::Point(proto::PointLight {
                position_in_world_m: vec3_to(position_in_world),
                intensity_linear_rgb: vec3_to(intensity_linear),
                radius_m,
            }),
            Light::Spot {
                position_in_world,
                forward_in_world,
                intensity_linear,
                inner_cone_rad,
                outer_cone_rad,
                radius_m,
            } => Kind::Spot(proto::SpotLight {
                position_in_world_m: vec3_to(position_in_world),
                forward_in_world_unit: vec3_to(forward_in_world),
                intensity_linear_rgb: vec3_to(intensity_linear),
                inner_cone_rad,
                outer_cone_rad,
                radius_m,
            }),
            Light::Rectangle { center_in_world, half_edges_in_world: [first, second], radiance_linear } => {
                Kind::Rectangle(proto::RectangleLight {
                    center_in_world_m: vec3_to(center_in_world),
                    first_half_edge_in_world_m: vec3_to(first),
                    second_half_edge_in_world_m: vec3_to(second),
                    radiance_linear_rgb: vec3_to(radiance_linear),
                })
            }
        };
        Self { kind: Some(kind) }
    }
}
