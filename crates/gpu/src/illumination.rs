//! Light sources as `light.wgsl` reads them.

use bytemuck::{Pod, Zeroable};
use depth_image::{Environment, Highlight, Illumination, Light};
use glam::Vec3;

/// `Light` of `light.wgsl`, which says what its numbers are.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuLight {
    pub middle_in_world: [f32; 3],
    pub kind: u32,
    pub color_linear: [f32; 3],
    pub extent: f32,
    pub axis_in_world: [f32; 3],
    /// −1 for all lights but spots.
    pub outer_cosine: f32,
    pub next_edge_in_world: [f32; 3],
    pub cone_scale: f32,
}

/// `Illumination` of `light.wgsl`, up to its lights.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuIllumination {
    pub zenith_linear: [f32; 3],
    pub light_count: u32,
    pub nadir_linear: [f32; 3],
    pub padding: u32,
}

const PARALLEL: u32 = 0;
const ROUND: u32 = 1;
const RECTANGLE: u32 = 2;

/// `Background` of `background.wgsl`: what rays that leave the scene show.
#[must_use]
pub fn background_bytes(background: &Environment) -> [f32; 8] {
    let ([r, g, b], nadir) = (background.zenith_linear.to_array(), background.nadir_linear.to_array());
    [r, g, b, 0.0, nadir[0], nadir[1], nadir[2], 0.0]
}

impl GpuLight {
    /// A light without colour or place, the same in all directions.
    fn dark() -> Self {
        Self { kind: ROUND, outer_cosine: -1.0, cone_scale: 1.0, ..Self::zeroed() }
    }

    fn round(middle: Vec3, color: Vec3, extent: f32) -> Self {
        Self { middle_in_world: middle.to_array(), color_linear: color.to_array(), extent, ..Self::dark() }
    }
}

impl From<&Light> for GpuLight {
    fn from(light: &Light) -> Self {
        match *light {
            Light::Directional { towards_light_in_world, irradiance_linear, angular_radius_rad } => Self {
                kind: PARALLEL,
                ..Self::round(towards_light_in_world, irradiance_linear, angular_radius_rad.tan())
            },
            Light::Point { position_in_world, intensity_linear, radius_m } => {
                Self::round(position_in_world, intensity_linear, radius_m)
            }
            Light::Spot {
                position_in_world,
                forward_in_world,
                intensity_linear,
                inner_cone_rad,
                outer_cone_rad,
                radius_m,
            } => Self {
                axis_in_world: forward_in_world.to_array(),
                outer_cosine: outer_cone_rad.cos(),
                cone_scale: (inner_cone_rad.cos() - outer_cone_rad.cos()).max(1e-4).recip(),
                ..Self::round(position_in_world, intensity_linear, radius_m)
            },
            Light::Rectangle { center_in_world, half_edges_in_world: [u, v], radiance_linear } => Self {
                kind: RECTANGLE,
                axis_in_world: u.to_array(),
                next_edge_in_world: v.to_array(),
                ..Self::round(center_in_world, radiance_linear, 0.0)
            },
        }
    }
}

/// `light_slots` of `light.wgsl`: an array in a uniform may not be empty.
#[must_use]
pub const fn light_slots(light_count: usize) -> usize {
    if light_count == 0 { 1 } else { light_count }
}

/// `highlight` of `highlight.wgsl`.
#[must_use]
pub const fn highlight_name(highlight: Highlight) -> &'static str {
    match highlight {
        Highlight::BlinnPhong => "blinn_phong",
        Highlight::Ggx => "ggx",
    }
}

/// The bytes of an `Illumination` uniform of [`light_slots`] lights.
#[must_use]
pub fn illumination_bytes(illumination: &Illumination) -> Vec<u8> {
    let head = GpuIllumination {
        zenith_linear: illumination.environment.zenith_linear.to_array(),
        light_count: illumination.lights.len() as u32,
        nadir_linear: illumination.environment.nadir_linear.to_array(),
        padding: 0,
    };
    let mut lights: Vec<GpuLight> = illumination.lights.iter().map(GpuLight::from).collect();
    lights.resize(light_slots(lights.len()), GpuLight::dark());
    [bytemuck::bytes_of(&head), bytemuck::cast_slice(&lights)].concat()
}
