//! The shader templates of this crate, the numbers that they share with Rust, and all their variants.

use gpu::{DynamicUniforms, ShaderError, ShaderSource, Templates, source, wgsl_constants, wgsl_files};

use crate::known_samples::LEAST_FACING;
use crate::rays::flat::{ALPHA_HASHED, ALPHA_TESTED, DOUBLE_SIDED, GLASS, SPECULAR, THIN, UNLIT, VERTEX};
use crate::rays::primary::{MOST_LAYERS, Primary};
use crate::rays::ray_scene::MATERIAL_TEXELS;
use crate::rays::traversal::{BOX_SLACK, EDGE_ROUNDINGS};
use crate::{
    coverage::{Coverage, MOST_COARSER},
    finish::{Finish, SAME_SURFACE},
    illuminate::Illuminate,
    keep::Keep,
    lamp_bits::LampBits,
    lamp_maps::MAPS_AT_ONCE,
    layered::{BIAS_FOOTPRINTS, BIAS_ROUNDINGS, Lit},
    light_cache::{LookUp, PROVENANCE_EMPTY, PROVENANCE_HIT, PROVENANCE_LIT_HERE},
    light_samples::MAX_CACHE_CAMERAS,
    pixel_list::LIST_WORKGROUP,
    raster::RasterVariant,
    redundancy_test::RedundancyTest,
    reflections::{Follow, Land, Lobe, LookThrough, MOST_INTERFACES, Spawn},
    sums::COLOR_SUMS,
    surfaces::{NOTHING, SEEN_THROUGH},
};

/// Numbers of a texture's wrap modes.
const MIRROR: u32 = scene::Wrap::Mirror as u32;
const CLAMP: u32 = scene::Wrap::Clamp as u32;
const MAX_LAMP_SHARES: u32 = depth_image::MAX_LAMP_SHARES as u32;

/// The shader templates of this crate.
pub const SHADERS: &[(&str, &str)] = &wgsl_files! {
    "raster.wgsl", "append.wgsl", "layered/lit.wgsl", "packed_surface.wgsl", "surfaces.wgsl", "albedo.wgsl", "camera.wgsl", "single_pole.wgsl", "sums.wgsl",
    "illuminate.wgsl", "lamp_bits.wgsl", "grid.wgsl", "indirect.wgsl", "light_cache.wgsl", "cached_texels.wgsl", "coverage.wgsl", "lamp_shares.wgsl", "pixel_list.wgsl", "triangle_normal.wgsl", "finish.wgsl", "known_samples.wgsl", "keep.wgsl", "footprint.wgsl", "hashed_alpha.wgsl",
    "rise.wgsl", "spot.wgsl", "shaded.wgsl", "visibility.wgsl", "reflections/bounce.wgsl", "reflections/bounce_off.wgsl", "reflections/ends.wgsl", "reflections/curvature.wgsl",
    "reflections/spawn.wgsl", "reflections/look_through.wgsl", "reflections/follow.wgsl", "reflections/cross_glass.wgsl", "reflections/land.wgsl", "reflections/lobe.wgsl",
    "rays/traverse.wgsl", "rays/material.wgsl", "rays/glass.wgsl", "rays/primary.wgsl"
};

/// Cameras and objects have an element for each dispatch or draw.
pub(crate) const DYNAMIC_UNIFORMS: DynamicUniforms = &["camera", "object"];

/// [`SHADERS`] and templates of redundancy tests, each with its name.
///
/// # Errors
/// When a text is not a template.
pub fn templates(tests: &[(&'static str, &'static str)]) -> Result<Templates, ShaderError> {
    Ok(Templates::new(&[SHADERS, tests].concat())?.with_dynamic_uniforms(DYNAMIC_UNIFORMS).declaring(wgsl_constants! {
        ALPHA_HASHED, ALPHA_TESTED, BIAS_FOOTPRINTS, BIAS_ROUNDINGS, BOX_SLACK, CLAMP, COLOR_SUMS, DOUBLE_SIDED, EDGE_ROUNDINGS, GLASS, LEAST_FACING, LIST_WORKGROUP, MAPS_AT_ONCE, MATERIAL_TEXELS, MAX_CACHE_CAMERAS, MAX_LAMP_SHARES, MIRROR, MOST_COARSER, MOST_INTERFACES, MOST_LAYERS,
        NOTHING, PROVENANCE_EMPTY, PROVENANCE_HIT, PROVENANCE_LIT_HERE, SAME_SURFACE, SEEN_THROUGH, SPECULAR, THIN, UNLIT, VERTEX
    }))
}

/// Every shader in the variants that stand for all, with `tests` that `templates` hold.
pub fn shader_sources<'t>(
    templates: &'t Templates,
    tests: &'t [RedundancyTest],
) -> impl Iterator<Item = Result<ShaderSource, ShaderError>> {
    gpu::shader_sources!(
        templates,
        RasterVariant,
        Primary,
        Keep,
        Illuminate,
        LampBits,
        LookUp,
        Coverage,
        Spawn,
        LookThrough,
        Lobe,
        Follow,
        Land,
        Lit,
        Finish
    )
    .chain(RasterVariant::with_tests(tests).map(|variant| source(templates, &variant)))
    .chain(Primary::with_tests(tests).map(|variant| source(templates, &variant)))
}
