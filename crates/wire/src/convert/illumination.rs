//! Lamps and environments.

use cluster::{InvalidField, at_most};
use depth_image::{Environment, Illumination, Light, MAX_LIGHTS};
use glam::Vec3;

use super::{Convert, required};
use crate::error::WireError;
use crate::proto::{self, light::Kind};

messages! {
    Illumination = Illumination { lights, environment as "illumination.environment" },
        first |i| at_most(i.lights.len(), MAX_LIGHTS, "illumination.lights");
    Environment = Environment {
        is_mapped; zenith_linear: zenith_linear_rgb as "environment.zenith_linear_rgb",
        nadir_linear: nadir_linear_rgb as "environment.nadir_linear_rgb"
    }, then |e| e.validate().map_err(|source| InvalidField::Light { field: "illumination.environment", source });
}

/// Both conversions of lights from one list of the kinds, as `messages!` has it.
macro_rules! lights {
    ($($kind:ident = $message:ident as $name:literal { $($own:ident: $($wire:ident)|+),+ };)+) => {
        #[allow(unused_parens, reason = "one field is no tuple")]
        impl Convert<proto::Light> for Light {
            fn read(light: proto::Light, _: &'static str) -> Result<Self, WireError> {
                let (light, name) = match required(light.kind, "light.kind")? {
                    $(Kind::$kind(light) => {
                        $(let $own = Convert::read(($(light.$wire),+), concat!("light.", $(stringify!($wire)),+))?;)+
                        (Self::$kind { $($own),+ }, $name)
                    })+
                };
                light.validate().map_err(|source| InvalidField::Light { field: name, source })?;
                Ok(light)
            }

            fn write(self) -> proto::Light {
                let kind = match self {
                    $(Self::$kind { $($own),+ } => {
                        $(let ($($wire),+) = Convert::write($own);)+
                        Kind::$kind(proto::$message { $($($wire),+),+ })
                    })+
                };
                proto::Light { kind: Some(kind) }
            }
        }
    };
}

lights! {
    Directional = DirectionalLight as "light.directional" {
        towards_light_in_world: towards_light_in_world_unit,
        irradiance_linear: irradiance_linear_rgb,
        angular_radius_rad: angular_radius_rad
    };
    Point = PointLight as "light.point" {
        position_in_world: position_in_world_m,
        intensity_linear: intensity_linear_rgb,
        radius_m: radius_m
    };
    Spot = SpotLight as "light.spot" {
        position_in_world: position_in_world_m,
        forward_in_world: forward_in_world_unit,
        intensity_linear: intensity_linear_rgb,
        inner_cone_rad: inner_cone_rad,
        outer_cone_rad: outer_cone_rad,
        radius_m: radius_m
    };
    Rectangle = RectangleLight as "light.rectangle" {
        center_in_world: center_in_world_m,
        half_edges_in_world: first_half_edge_in_world_m | second_half_edge_in_world_m,
        radiance_linear: radiance_linear_rgb
    };
}

impl Convert<(Option<proto::Vec3>, Option<proto::Vec3>)> for [Vec3; 2] {
    fn read(half_edges: (Option<proto::Vec3>, Option<proto::Vec3>), _: &'static str) -> Result<Self, WireError> {
        let first = Convert::read(half_edges.0, "light.first_half_edge_in_world_m")?;
        Ok([first, Convert::read(half_edges.1, "light.second_half_edge_in_world_m")?])
    }

    fn write(self) -> (Option<proto::Vec3>, Option<proto::Vec3>) {
        let [first, second] = self;
        (first.write(), second.write())
    }
}
