//! The shader templates of this crate, the numbers that they share with Rust, and all their variants.

use gpu::{ShaderError, ShaderSource, Templates, source, sources, wgsl_constants};

use crate::{
    finish::FinishVariant,
    illuminate::{GRID_PX, IlluminateVariant},
    interpolate::InterpolateVariant,
    keep::KeepVariant,
    known_samples::{LEAST_FACING, REFERENCE_FOOTPRINTS},
    pixel_list::LIST_WORKGROUP,
    raster::RasterVariant,
    rays::{
        flat::{ALPHA_TESTED, DOUBLE_SIDED, SPECULAR, UNLIT, VERTEX},
        primary::{MOST_LAYERS, PrimaryVariant},
        traversal::{BOX_SLACK, EDGE_ROUNDINGS},
    },
    redundancy_test::RedundancyTest,
    sums::COLOR_SUMS,
    surfaces::NOTHING,
};

/// The shader templates of this crate.
pub const SHADERS: &[(&str, &str)] = &[
    ("raster.wgsl", include_str!("raster.wgsl")),
    ("packed_surface.wgsl", include_str!("packed_surface.wgsl")),
    ("surfaces.wgsl", include_str!("surfaces.wgsl")),
    ("albedo.wgsl", include_str!("albedo.wgsl")),
    ("camera.wgsl", include_str!("camera.wgsl")),
    ("sequence.wgsl", include_str!("sequence.wgsl")),
    ("sums.wgsl", include_str!("sums.wgsl")),
    ("illuminate.wgsl", include_str!("illuminate.wgsl")),
    ("interpolate.wgsl", include_str!("interpolate.wgsl")),
    ("finish.wgsl", include_str!("finish.wgsl")),
    ("known_samples.wgsl", include_str!("known_samples.wgsl")),
    ("keep.wgsl", include_str!("keep.wgsl")),
    ("footprint.wgsl", include_str!("footprint.wgsl")),
    ("rays/traverse.wgsl", include_str!("rays/traverse.wgsl")),
    ("rays/material.wgsl", include_str!("rays/material.wgsl")),
    ("rays/primary.wgsl", include_str!("rays/primary.wgsl")),
];

/// [`SHADERS`] and templates of redundancy tests, each with its name.
///
/// # Errors
/// When a text is not a template.
pub fn templates(tests: &[(&'static str, &'static str)]) -> Result<Templates, ShaderError> {
    let constants = wgsl_constants![
        ALPHA_TESTED,
        BOX_SLACK,
        COLOR_SUMS,
        DOUBLE_SIDED,
        EDGE_ROUNDINGS,
        GRID_PX,
        LEAST_FACING,
        LIST_WORKGROUP,
        MOST_LAYERS,
        NOTHING,
        REFERENCE_FOOTPRINTS,
        SPECULAR,
        UNLIT,
        VERTEX,
    ];
    Ok(Templates::new(&[SHADERS, tests].concat())?.with_constants(constants))
}

/// Every shader in the variants that stand for all, with `tests` that `templates` hold.
pub fn shader_sources<'t>(
    templates: &'t Templates,
    tests: &'t [RedundancyTest],
) -> impl Iterator<Item = Result<ShaderSource, ShaderError>> {
    sources::<RasterVariant>(templates)
        .chain(sources::<PrimaryVariant>(templates))
        .chain(sources::<KeepVariant>(templates))
        .chain(sources::<IlluminateVariant>(templates))
        .chain(sources::<InterpolateVariant>(templates))
        .chain(sources::<FinishVariant>(templates))
        .chain(RasterVariant::with_tests(tests).map(|variant| source(templates, &variant)))
        .chain(PrimaryVariant::with_tests(tests).map(|variant| source(templates, &variant)))
        .chain(FinishVariant::with_tests(tests).map(|variant| source(templates, &variant)))
}
