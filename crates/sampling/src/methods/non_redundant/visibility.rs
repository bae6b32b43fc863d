//! The numbers of `visibility.wgsl`.

use gpu::wgsl_constants;

/// The share of its depth that a point may be off by.
pub const SAME_DEPTH: f32 = 2e-5;
/// The share of the pixel's length on the surface that a point may be off by, besides.
pub const SAME_FOOTPRINTS: f32 = 0.0625;

pub(super) fn constants() -> [(&'static str, String); 2] {
    wgsl_constants![SAME_DEPTH, SAME_FOOTPRINTS]
}
