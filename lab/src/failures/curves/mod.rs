//! All curves: tests measure them at a small size, the study at its full size.

mod background;
mod courtyard;
mod cube_edges;
mod cube_mirrors;
mod depth_range;
mod epsilon;
mod frames;
mod gather;
mod k_fd;
mod layers;
mod leaves;
mod light;
mod light_cache;
mod odd_eyes;
mod poles;
mod quads;
mod redundancy;
mod sphere;
mod texels;
mod thickness;
mod view_cell;

use super::curve::Curve;

/// Families of curves that share their scene or their parts.
pub const CURVES: [&[Curve]; 21] = [
    &poles::CURVES,
    &sphere::CURVES,
    &[thickness::CURVE],
    &[epsilon::CURVE],
    &[texels::CURVE],
    &cube_edges::CURVES,
    &leaves::CURVES,
    &cube_mirrors::CURVES,
    &gather::CURVES,
    &odd_eyes::CURVES,
    &view_cell::CURVES,
    &[courtyard::CURVE],
    &depth_range::CURVES,
    &background::CURVES,
    &light::CURVES,
    &light_cache::CURVES,
    &frames::CURVES,
    &quads::CURVES,
    &redundancy::CURVES,
    &layers::CURVES,
    &k_fd::CURVES,
];

/// All curves, in the order of the report.
pub fn all() -> impl Iterator<Item = &'static Curve> {
    CURVES.iter().copied().flatten()
}
