//! Passes that are built when they are first asked for, and kept.

use std::{collections::HashMap, sync::Arc};

use parking_lot::Mutex;

use super::{
    compiled::Shader,
    compute_pass::ComputePass,
    template::Templates,
    variant::{Pass, ShaderVariant},
};
use crate::{device::Gpu, error::ShaderError};

/// The passes of one shader, by its variants.
pub struct PassCache<V, P = ComputePass> {
    gpu: Arc<Gpu>,
    templates: Arc<Templates>,
    passes: Mutex<HashMap<V, Arc<P>>>,
}

impl<V: ShaderVariant, P: Pass<V>> PassCache<V, P> {
    /// An empty cache.
    #[must_use]
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { gpu: gpu.clone(), templates: templates.clone(), passes: Mutex::default() }
    }

    /// The pass of a variant, built at the first call.
    ///
    /// # Errors
    /// A template that is broken, or WGSL that cannot be parsed.
    pub fn get(&self, variant: &V) -> Result<Arc<P>, ShaderError> {
        let mut passes = self.passes.lock();
        if let Some(pass) = passes.get(variant) {
            return Ok(pass.clone());
        }
        let wgsl = self.templates.render(V::TEMPLATE, variant.context())?;
        let shader = Shader::new(&self.gpu, V::TEMPLATE, &wgsl, V::TRAITS)?;
        let pass = Arc::new(P::build(&self.gpu, shader, variant));
        passes.insert(variant.clone(), pass.clone());
        Ok(pass)
    }
}
