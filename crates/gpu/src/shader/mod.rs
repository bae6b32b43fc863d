//! Shaders: WGSL written out of templates, what it declares, and passes that are bound to it by name.

mod binding;
mod compiled;
mod compute_pass;
mod constant;
mod draw_pass;
mod interface;
mod pass_cache;
mod template;
mod variant;

pub use binding::Binding;
pub use compiled::Shader;
pub use compute_pass::{ComputePass, DispatchSize};
pub use constant::WgslLiteral;
pub use draw_pass::{DrawPass, DrawState, DrawVariant};
pub use interface::{ResourceTrait, ResourceTraits, ShaderInterface};
pub use pass_cache::PassCache;
pub use template::Templates;
pub use variant::{Pass, ShaderSource, ShaderVariant, source, sources, switches};
