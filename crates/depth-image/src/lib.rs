//! Camera models, and depth images with explicit holes.
//!
//! World space is right-handed, in metres, +Y up; a camera looks down its -Z. Pixels run top-down with centres at
//! +0.5. *Planar depth* is the distance along the camera's forward axis. *Inverse depth* is its reciprocal, which is
//! linear in screen space on planes and along projected rays.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod antialias;
mod bounds;
mod camera;
mod cube_grid;
mod encoding;
mod environment_light;
mod environment_map;
mod highlight;
mod image;
mod lamp_rig;
mod layered;
mod light;
mod light_cache;
mod light_directions;
mod light_field;
mod method_table;
mod parallel;
mod pinhole;
mod projection;
mod sample_camera;
mod sample_image;
mod sample_image_error;
mod scalar;
mod single_pole;
mod source_space;
mod tiles;
mod tone;
mod view;
mod view_cell;
mod view_group;
mod view_part;
mod work;

pub use antialias::{Antialias, AntialiasError};
pub use bounds::Aabb;
pub use camera::Camera;
pub use cube_grid::{CUBE_SIDES, CubeGrid};
pub use encoding::{
    linear_from_rgb9e5, linear_from_srgb8, oct8_from_oct16, oct8_from_unit, oct16_from_unit, rgb9e5_from_linear,
    srgb8_from_linear, unit_from_oct8,
};
pub use environment_light::{BrightTexel, EnvironmentLight, LOBE_ROUGHNESS, LOBE_SIZE_PX, Lobe};
pub use environment_map::{EnvironmentMap, EnvironmentMapError, MAX_ENVIRONMENT_SIZE_PX};
pub use highlight::{Highlight, MAX_MIRROR_CELLS, MAX_REFLECTIONS, ROUGHEST_MIRROR, Reflector};
pub use image::{
    BACKGROUND_INVERSE_DEPTH, DepthImage, HOLE_INVERSE_DEPTH, LightPlanes, MAX_LAMP_SHARES, SpecularPlanes, SurfaceId,
};
pub use lamp_rig::{LampRig, MAX_LAMP_SLOPE};
pub use layered::LayeredDepthImage;
pub use light::{Environment, Illumination, Light, LightError, MAX_LIGHTS};
pub use light_cache::LightCacheQuality;
pub use light_directions::{LightDirection, LightDirections};
pub use light_field::{LIGHT_FIELD_SIDES, LayeredLightField, LightFieldCamera};
pub use method_table::{NamedMethod, Setting, method_forms, method_help, method_named};
pub use parallel::ParallelCamera;
pub use pinhole::PinholeCamera;
pub use projection::{CameraError, MAX_IMAGE_SIDE_PX, PixelDepth, Ray};
pub use sample_camera::SampleCamera;
pub use sample_image::{CubeImages, SampleImage, SampleImages};
pub use sample_image_error::{MAX_LAYERS, SampleImageError};
pub use scalar::{
    Incident, Texel, disc_from_square, environment_highlight_linear, environment_reflectance_linear, highlight_linear,
    tangents_of, unit_from_oct16,
};
pub use single_pole::SinglePoleCamera;
pub use source_space::SourceSpace;
pub use tone::{Exposure, ExposureEv, ToneCurve, ToneError, ToneMapping};
pub use view::{Provenance, ProvenanceKind, View, ViewPlanes};
pub use view_cell::{ViewCell, nested_places};
pub use view_group::{ViewGroup, nearest_set};
pub use view_part::{VIEW_REACH_PX, ViewPart};
pub use work::{Refinement, Turn, WorkClass};
