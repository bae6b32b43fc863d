//! Variants of a shader: the switches that are written into its text.

use std::fmt::Debug;

use minijinja::{Value, context};

use super::{compiled::Shader, interface::DynamicUniforms, template::Templates};
use crate::{device::Gpu, error::ShaderError};

/// A shader's switches. Each set of them is a text of its own, and has its own `Debug` text.
pub trait ShaderVariant: Debug {
    /// The template, which is also the label of its passes.
    const TEMPLATE: &'static str;
    /// Uniforms with dynamic offsets. A variant that names none has those of the templates.
    const DYNAMIC_UNIFORMS: DynamicUniforms = &[];

    /// The values that the template uses.
    fn context(&self) -> Value {
        context! {}
    }

    /// The variants that stand for all: each switch in each position, few and many of what is counted.
    fn all() -> Vec<Self>
    where
        Self: Sized;

    /// The template and the switches.
    fn name(&self) -> String {
        format!("{}: {self:?}", Self::TEMPLATE)
    }
}

/// Declares a shader variant without switches, or with those that another type has: its `context` and its `all`.
#[macro_export]
macro_rules! shader_variant {
    ($name:ident, $template:literal, $dynamic_uniforms:expr) => {
        #[doc = concat!("`", $template, "`, which has no switches.")]
        #[derive(Debug)]
        pub(crate) struct $name;

        impl $crate::ShaderVariant for $name {
            const TEMPLATE: &'static str = $template;
            const DYNAMIC_UNIFORMS: $crate::DynamicUniforms = $dynamic_uniforms;
            fn all() -> Vec<Self> {
                vec![Self]
            }
        }
    };
    ($name:ident($switches:ty), $template:literal, $dynamic_uniforms:expr) => {
        #[doc = concat!("The switches of `", $template, "`.")]
        #[derive(Debug)]
        pub(crate) struct $name(pub $switches);

        impl $crate::ShaderVariant for $name {
            const TEMPLATE: &'static str = $template;
            const DYNAMIC_UNIFORMS: $crate::DynamicUniforms = $dynamic_uniforms;
            fn context(&self) -> minijinja::Value {
                self.0.context()
            }
            fn all() -> Vec<Self> {
                <$switches>::all().into_iter().map(Self).collect()
            }
        }
    };
}

/// A pass that is built from a variant's shader.
pub trait Pass<V>: Sized {
    /// Builds the pipeline.
    fn build(gpu: &Gpu, shader: Shader, variant: &V) -> Self;
}

/// A variant, written out.
#[derive(Debug, Clone)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct ShaderSource {
    pub name: String,
    pub template: &'static str,
    pub wgsl: String,
    pub dynamic_uniforms: DynamicUniforms,
}

/// The texts of [`ShaderVariant::all`].
pub fn sources<V: ShaderVariant>(templates: &Templates) -> impl Iterator<Item = Result<ShaderSource, ShaderError>> {
    V::all().into_iter().map(|variant| source(templates, &variant))
}

/// The texts of all variants of several shaders: `shader_sources!(&templates, Fill, Merge)`.
#[macro_export]
macro_rules! shader_sources {
    ($templates:expr, $($variant:ty),+ $(,)?) => { std::iter::empty()$(.chain($crate::sources::<$variant>($templates)))+ };
}

/// The text of a variant.
///
/// # Errors
/// A template that is broken.
pub fn source<V: ShaderVariant>(templates: &Templates, variant: &V) -> Result<ShaderSource, ShaderError> {
    let wgsl = templates.render(V::TEMPLATE, variant.context())?;
    let dynamic_uniforms =
        if V::DYNAMIC_UNIFORMS.is_empty() { templates.dynamic_uniforms } else { V::DYNAMIC_UNIFORMS };
    Ok(ShaderSource { name: variant.name(), template: V::TEMPLATE, wgsl, dynamic_uniforms })
}

/// Every position of `N` switches.
pub fn switches<const N: usize>() -> impl Iterator<Item = [bool; N]> {
    (0..1_usize << N).map(|bits| std::array::from_fn(|switch| bits >> switch & 1 == 1))
}
