//! The numbers of `tolerance.wgsl`.

use gpu::wgsl_constants;

/// Depths are the same within this many footprints.
pub const DEPTH_FOOTPRINTS: f32 = 2.0;
/// The pixels for which a surface may go on changing its depth at its own slope.
pub const SLOPE_PX: f32 = 1.0;
/// The cosine of 25 degrees.
pub const SAME_FACING: f32 = 0.906_307_8;
/// The greatest ratio of footprints.
pub const COARSER: f32 = 1.5;
/// The share of these limits that samples of the temporal reference are held to.
pub const CLEARLY: f32 = 0.8;
/// The cosine of 20 degrees, for samples of the temporal reference.
pub const CLEARLY_SAME_FACING: f32 = 0.939_692_6;

pub(super) fn constants() -> [(&'static str, String); 6] {
    wgsl_constants![DEPTH_FOOTPRINTS, SLOPE_PX, SAME_FACING, COARSER, CLEARLY, CLEARLY_SAME_FACING]
}
