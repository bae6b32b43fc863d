//! An engine that copes with the faults of its device. Where memory runs out, cached sets are freed and the work is tried
//! once more, in smaller calls; the node leaves the cluster for a while where that does not help. A lost device is noticed.

use std::any::Any;
use std::sync::Arc;

use cluster::SamplePlanes;
use depth_image::{PinholeCamera, SampleImage, Turn, View};
use parking_lot::Mutex;
use tokio::sync::watch;

use crate::engine::{
    CommonSet, DirectWork, Engine, EngineError, LightParts, SampleSet, SampleWork, SharedSet, UploadedSet, ViewWork,
};

/// Calls that run out of memory one after the other, until the node leaves.
const MAX_SHORTAGES: usize = 3;

/// Frees the sets of a cache that are not in use; gives their bytes.
type FreeMemory = Arc<dyn Fn() -> usize + Send + Sync>;

/// An engine with help for the faults of the device inside. Clones share it.
#[derive(Clone)]
pub struct DeviceMonitor {
    engine: Arc<dyn Engine>,
    lost: watch::Sender<Option<String>>,
    /// Calls that have run out of memory since the last that did not.
    shortages: watch::Sender<usize>,
    memory: Arc<Mutex<Vec<FreeMemory>>>,
}

impl DeviceMonitor {
    /// Monitors an engine.
    pub(crate) fn new(engine: Arc<dyn Engine>) -> Self {
        Self { engine, lost: watch::Sender::new(None), shortages: watch::Sender::new(0), memory: Arc::default() }
    }

    /// Adds sets to free where the device runs out of memory.
    pub fn add_memory(&self, free: impl Fn() -> usize + Send + Sync + 'static) {
        self.memory.lock().push(Arc::new(free));
    }

    /// Frees the sets that are not in use; gives their bytes.
    fn free(&self) -> usize {
        let memory = self.memory.lock().clone();
        memory.iter().map(|free| free()).sum()
    }

    /// Resolves when the device is lost, with the reason.
    pub async fn lost(&self) -> String {
        let mut lost = self.lost.subscribe();
        // This value owns a sender, which therefore outlives the wait.
        let reason = lost.wait_for(Option::is_some).await.ok().and_then(|reason| reason.clone());
        reason.unwrap_or_default()
    }

    /// Frees the sets that are not in use, and counts calls that run out of memory anew.
    pub fn begin_anew(&self) {
        self.free();
        self.shortages.send_replace(0);
    }

    /// Resolves when several calls in a row have run out of memory, whatever was freed.
    pub async fn exhausted(&self) {
        let mut shortages = self.shortages.subscribe();
        let _ = shortages.wait_for(|count| *count >= MAX_SHORTAGES).await;
    }

    fn monitored<T>(&self, done: Result<T, EngineError>) -> Result<T, EngineError> {
        if let Err(EngineError::Lost(reason)) = &done {
            self.lost.send_replace(Some(reason.clone()));
        }
        done
    }

    /// Does work, and once more where memory ran out; `work` is told whether this is the second try.
    fn relieved<T>(&self, work: impl Fn(bool) -> Result<T, EngineError>) -> Result<T, EngineError> {
        let done = match work(false) {
            Err(EngineError::OutOfMemory(reason)) => {
                let freed_bytes = self.free();
                tracing::warn!(reason, freed_bytes, "out of device memory: tried once more");
                work(true)
            }
            done => done,
        };
        match &done {
            Ok(_) => drop(self.shortages.send_if_modified(|count| std::mem::take(count) > 0)),
            Err(EngineError::OutOfMemory(_)) => self.shortages.send_modify(|count| *count += 1),
            Err(_) => (),
        }
        self.monitored(done)
    }

    /// Makes views, in halves where memory ran out.
    fn in_halves(
        &self,
        cameras: &[PinholeCamera],
        make: impl Fn(&[PinholeCamera]) -> Result<Vec<View>, EngineError>,
    ) -> Result<Vec<View>, EngineError> {
        self.relieved(|in_halves| {
            if !in_halves {
                return make(cameras);
            }
            let made = cameras.chunks(cameras.len().div_ceil(2).max(1)).map(&make);
            Ok(made.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
        })
    }
}

impl Engine for DeviceMonitor {
    fn device_name(&self) -> String {
        self.engine.device_name()
    }

    fn is_software(&self) -> bool {
        self.engine.is_software()
    }

    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<(), EngineError> {
        self.relieved(|_| self.engine.load_scene(hash, package))
    }

    fn has_scene(&self, hash: &str) -> bool {
        self.engine.has_scene(hash)
    }

    fn images_are_independent(&self, sampling: &str) -> Result<bool, EngineError> {
        self.monitored(self.engine.images_are_independent(sampling))
    }

    fn images_are_sequential(&self, sampling: &str) -> Result<bool, EngineError> {
        self.monitored(self.engine.images_are_sequential(sampling))
    }

    fn sample_planes(&self, method: &str) -> Result<SamplePlanes, EngineError> {
        self.monitored(self.engine.sample_planes(method))
    }

    fn preview_lighting(&self, lighting: &str) -> Result<String, EngineError> {
        self.monitored(self.engine.preview_lighting(lighting))
    }

    fn live_stream(&self) -> Box<dyn Any + Send + Sync> {
        self.engine.live_stream()
    }

    fn waited_s(&self) -> f64 {
        self.engine.waited_s()
    }

    fn sample(&self, request: &SampleWork, turn: Turn) -> Result<Vec<SampleImage>, EngineError> {
        self.relieved(|_| self.engine.sample(request, turn))
    }

    fn upload(&self, set: &SampleSet, turn: Turn) -> Result<SharedSet, EngineError> {
        self.relieved(|_| self.engine.upload(set, turn))
    }

    fn with_common(&self, set: SharedSet, common: Vec<CommonSet>) -> Result<SharedSet, EngineError> {
        self.monitored(self.engine.with_common(set, common))
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork, turn: Turn) -> Result<Vec<View>, EngineError> {
        self.in_halves(&work.cameras, |cameras| {
            self.engine.reconstruct(set, &ViewWork { cameras: cameras.to_vec(), ..work.clone() }, turn)
        })
    }

    fn light_parts(
        &self,
        set: &dyn UploadedSet,
        work: &ViewWork,
        turn: Turn,
    ) -> Result<Option<LightParts>, EngineError> {
        self.monitored(self.engine.light_parts(set, work, turn))
    }

    fn traced_pixel_count(&self, work: &DirectWork, turn: Turn) -> Result<Option<u32>, EngineError> {
        self.monitored(self.engine.traced_pixel_count(work, turn))
    }

    fn draw_direct(&self, work: &DirectWork, turn: Turn) -> Result<Vec<View>, EngineError> {
        self.in_halves(&work.cameras, |cameras| {
            self.engine.draw_direct(&DirectWork { cameras: cameras.to_vec(), ..work.clone() }, turn)
        })
    }
}
