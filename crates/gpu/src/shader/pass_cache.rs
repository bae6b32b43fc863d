//! Passes that are built when they are first asked for, and kept.

use std::{collections::HashMap, sync::Arc};

use parking_lot::Mutex;

use super::compiled::Shader;
use super::compute_pass::ComputePass;
use super::template::Templates;
use super::variant::{Pass, ShaderVariant, source};
use crate::{device::Gpu, error::ShaderError};

/// A pass, once it is built.
type Entry<P> = Arc<Mutex<Option<Arc<P>>>>;

/// Passes of all shaders, by the names of their variants.
pub struct PassCache<P = ComputePass> {
    gpu: Arc<Gpu>,
    templates: Arc<Templates>,
    passes: Mutex<HashMap<String, Entry<P>>>,
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
        let entry = self.passes.lock().entry(variant.name()).or_default().clone();
        // Held while the pass is built: only those who want this one wait.
        let mut entry = entry.lock();
        if let Some(pass) = &*entry {
            return Ok(pass.clone());
        }
        let source = source(&self.templates, variant)?;
        let shader = Shader::new(&self.gpu, source.template, &source.wgsl, source.traits)?;
        let pass = Arc::new(P::build(&self.gpu, shader, variant));
        *entry = Some(pass.clone());
        Ok(pass)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Barrier, mpsc};
    use std::time::Duration;

    use super::*;
    use crate::{device::DevicePreference, shader_variant};

    shader_variant!(Slow, "slow.wgsl", &[]);
    shader_variant!(Fast, "fast.wgsl", &[]);

    const WGSL: &str = "@compute @workgroup_size(1) fn main() {}";
    static SLOW_BEGINS: Barrier = Barrier::new(2);
    static SLOW_MAY_END: Barrier = Barrier::new(2);

    struct Built;

    impl Pass<Slow> for Built {
        fn build(_: &Gpu, _: Shader, _: &Slow) -> Self {
            SLOW_BEGINS.wait();
            SLOW_MAY_END.wait();
            Self
        }
    }

    impl Pass<Fast> for Built {
        fn build(_: &Gpu, _: Shader, _: &Fast) -> Self {
            Self
        }
    }

    #[test]
    fn a_pass_that_is_being_built_delays_no_other() {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let templates = Templates::new(&[("slow.wgsl", WGSL), ("fast.wgsl", WGSL)]).expect("templates");
        let cache = PassCache::<Built>::new(&gpu, &Arc::new(templates));
        let (done, fast) = mpsc::channel();
        std::thread::scope(|threads| {
            let slow = threads.spawn(|| cache.get(&Slow).map(drop));
            SLOW_BEGINS.wait();
            threads.spawn(|| done.send(cache.get(&Fast).is_ok()));
            let fast = fast.recv_timeout(Duration::from_secs(10));
            SLOW_MAY_END.wait();
            assert_eq!((fast, slow.join().expect("no panic").is_ok()), (Ok(true), true));
        });
    }
}
