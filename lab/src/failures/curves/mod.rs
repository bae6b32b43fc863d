//! All curves: tests measure them at a small size, the study at its full size.

mod background;
mod cubes;
mod frames;
mod light;
mod light_cache;
mod light_field;
mod quads;
mod redundancy;
mod surfaces;
mod view_cell;

use super::curve::Curve;

/// Families of curves that share their scene or their parts.
const FAMILIES: [&[Curve]; 10] = [
    &surfaces::CURVES,
    &background::CURVES,
    &view_cell::CURVES,
    &cubes::CURVES,
    &[light_field::CURVE],
    &quads::CURVES,
    &light::CURVES,
    &light_cache::CURVES,
    &frames::CURVES,
    &redundancy::CURVES,
];

/// All curves, in the order of the report.
pub fn all() -> impl Iterator<Item = &'static Curve> {
    FAMILIES.iter().copied().flatten()
}
