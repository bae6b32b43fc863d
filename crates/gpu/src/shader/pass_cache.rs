//! Passes that are built when they are first asked for, and kept.

use std::{collections::HashMap, sync::Arc};

use parking_lot::Mutex;

use super::compiled::Shader;
use super::compute_pass::ComputePass;
use super::template::Templates;
use super::variant::{Pass, ShaderVariant, source};
use crate::{device::Gpu, error::ShaderError};

/// Passes of all shaders, by the names of their variants.
pub struct PassCache<P = ComputePass> {
    gpu: Arc<Gpu>,
    templates: Arc<Templates>,
    passes: Mutex<HashMap<String, Arc<P>>>,
}

impl<P> PassCache<P> {
    /// An empty cache.
    #[must_use]
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { gpu: gpu.clone(), templates: templates.clone(), passes: Mutex::default() }
    }

    /// The pass of a variant, built at the first call.
    ///
    /// # Errors
    /// A template that is broken, or WGSL that cannot be parsed.
    pub fn get<V: ShaderVariant>(&self, variant: &V) -> Result<Arc<P>, ShaderError>
    where
        P: Pass<V>,
    {
        let mut passes = self.passes.lock();
        if let Some(pass) = passes.get(&variant.name()) {
            return Ok(pass.clone());
        }
        let source = source(&self.templates, variant)?;
        let shader = Shader::new(&self.gpu, source.template, &source.wgsl, source.traits)?;
        let pass = Arc::new(P::build(&self.gpu, shader, variant));
        passes.insert(source.name, pass.clone());
        Ok(pass)
    }
}
