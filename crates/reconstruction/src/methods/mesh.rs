//! The conventional mesh: a quad between each four neighbouring samples of one surface.

use gpu::shader_variant;

shader_variant!(CutBetweenSamples, "mesh.wgsl", &[]);
