//! Variants of a shader: the switches that are written into its text.

use std::{fmt::Debug, hash::Hash};

use minijinja::Value;

use super::{compiled::Shader, interface::ResourceTraits, template::Templates};
use crate::{device::Gpu, error::ShaderError};

/// A shader's switches. Each set of them is a text of its own.
pub trait ShaderVariant: Debug + Clone + Eq + Hash {
    /// The template, which is also the label of its passes.
    const TEMPLATE: &'static str;
    /// Properties of resources that WGSL does not say.
    const TRAITS: ResourceTraits = &[];

    /// The values that the template uses.
    fn context(&self) -> Value;

    /// The variants that stand for all: each switch in each position, few and many of what is counted.
    fn all() -> Vec<Self>;
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
    /// The variant with its switches.
    pub name: String,
    pub template: &'static str,
    pub wgsl: String,
    pub traits: ResourceTraits,
}

/// The texts of [`ShaderVariant::all`].
pub fn sources<V: ShaderVariant>(templates: &Templates) -> impl Iterator<Item = Result<ShaderSource, ShaderError>> {
    V::all().into_iter().map(|variant| source(templates, &variant))
}

/// The text of a variant.
///
/// # Errors
/// A template that is broken.
pub fn source<V: ShaderVariant>(templates: &Templates, variant: &V) -> Result<ShaderSource, ShaderError> {
    let wgsl = templates.render(V::TEMPLATE, variant.context())?;
    let name = format!("{}: {variant:?}", V::TEMPLATE);
    Ok(ShaderSource { name, template: V::TEMPLATE, wgsl, traits: V::TRAITS })
}

/// Every position of `N` switches.
pub fn switches<const N: usize>() -> impl Iterator<Item = [bool; N]> {
    (0..1_usize << N).map(|bits| std::array::from_fn(|switch| bits >> switch & 1 == 1))
}
