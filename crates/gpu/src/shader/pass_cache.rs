//! Passes that are built when they are first asked for, and kept.

use std::{collections::HashMap, sync::Arc};

use parking_lot::Mutex;

use super::compiled::Shader;
use super::compute_pass::ComputePass;
use super::template::Templates;
use super::variant::{Pass, ShaderVariant, source};
use crate::{device::Gpu, error::ShaderError};

/// Passes that are kept; the one that was used longest ago goes first.
const MOST_PASSES: usize = 256;

/// A pass, once it is built.
type Entry<P> = Arc<Mutex<Option<Arc<P>>>>;

/// Passes of all shaders, by the names of their variants.
pub struct PassCache<P = ComputePass> {
    gpu: Arc<Gpu>,
    templates: Arc<Templates>,
    passes: Mutex<Passes<P>>,
}

struct Passes<P> {
    /// With the clock's value when they were last used.
    entries: HashMap<String, (Entry<P>, u64)>,
    /// Counts uses.
    clock: u64,
}

impl<P> Passes<P> {
    fn entry(&mut self, name: String) -> Entry<P> {
        self.clock += 1;
        let (entry, last_used) = self.entries.entry(name).or_default();
        *last_used = self.clock;
        let entry = entry.clone();
        if self.entries.len() > MOST_PASSES {
            let oldest = self.entries.iter().min_by_key(|(_, (_, last_used))| *last_used).map(|(name, _)| name.clone());
            oldest.and_then(|name| self.entries.remove(&name));
        }
        entry
    }
}

impl<P> PassCache<P> {
    /// An empty cache.
    #[must_use]
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self {
            gpu: gpu.clone(),
            templates: templates.clone(),
            passes: Mutex::new(Passes { entries: HashMap::new(), clock: 0 }),
        }
    }

    /// The pass of a variant, built at the first call.
    ///
    /// # Errors
    /// A template that is broken, or WGSL that cannot be parsed.
    pub fn get<V: ShaderVariant>(&self, variant: &V) -> Result<Arc<P>, ShaderError>
    where
        P: Pass<V>,
    {
        let entry = self.passes.lock().entry(variant.name());
        // Held while the pass is built: only those who want this one wait.
        let mut entry = entry.lock();
        if let Some(pass) = &*entry {
            return Ok(pass.clone());
        }
        let source = source(&self.templates, variant)?;
        let shader = Shader::new(&self.gpu, source.template, &source.wgsl, source.dynamic_uniforms)?;
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
    fn passes_by_the_thousand_leave_those_that_are_in_use() {
        let mut passes = Passes::<()> { entries: HashMap::new(), clock: 0 };
        for number in 0..2000 {
            passes.entry("in use".to_owned());
            passes.entry(number.to_string());
        }
        let mut kept = ["in use", "1999", "1"].map(|name| passes.entries.contains_key(name)).to_vec();
        kept.push(passes.entries.len() == MOST_PASSES);
        assert_eq!(kept, [true, true, false, true]);
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
