//! Shaders: WGSL written out of templates, what it declares, and passes that are bound to it by name.

mod bound_group;
mod compiled;
mod compute_pass;
mod draw_pass;
mod interface;
mod pass_cache;
mod template;
mod variant;
mod warming;

pub use bound_group::BoundGroup;
pub use compiled::Shader;
pub use compute_pass::{ComputePass, DispatchSize};
pub use draw_pass::{DrawPass, DrawState, DrawVariant};
pub use interface::{Binding, DynamicUniforms, ShaderInterface, uniform_elements, uniform_stride};
pub use pass_cache::PassCache;
pub use template::{Templates, WgslLiteral};
pub use variant::{Pass, ShaderSource, ShaderVariant, source, sources, switches};
