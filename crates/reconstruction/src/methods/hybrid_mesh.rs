//! Xie's hybrid reconstruction: each sample a quad of its texel, corners shared with its neighbours, and rectangles
//! of quads merged where a surface is flat.

use gpu::shader_variant;

/// The greatest slope of a surface against a line of sight at a guessed corner: the tangent of 87.5°. Beyond, the
/// corner runs to infinity.
pub(crate) const GREATEST_SLOPE: f32 = 22.903_765;

shader_variant!(CutTexels, "hybrid_mesh.wgsl", &[]);
