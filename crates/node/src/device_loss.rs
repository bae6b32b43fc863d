//! The loss of a device, noticed at the first call that fails for it.

use std::sync::Arc;

use depth_image::{DepthImage, View};
use tokio::sync::watch;

use crate::engine::{DirectWork, Engine, EngineError, SampleSet, SampleWork, UploadedSet, ViewWork};

/// An engine that notices when the device of the engine inside is lost.
#[derive(Clone)]
pub struct DeviceLossMonitor {
    engine: Arc<dyn Engine>,
    lost: watch::Sender<Option<String>>,
}

impl DeviceLossMonitor {
    /// Monitors an engine.
    #[must_use]
    pub fn new(engine: Arc<dyn Engine>) -> Self {
        Self { engine, lost: watch::Sender::new(None) }
    }

    /// Resolves when the device is lost, with the reason.
    pub async fn lost(&self) -> String {
        let mut lost = self.lost.subscribe();
        // This value owns a sender, which therefore outlives the wait.
        let reason = lost.wait_for(Option::is_some).await.ok().and_then(|reason| reason.clone());
        reason.unwrap_or_default()
    }

    fn monitored<T>(&self, done: Result<T, EngineError>) -> Result<T, EngineError> {
        if let Err(EngineError::Lost(reason)) = &done {
            self.lost.send_replace(Some(reason.clone()));
        }
        done
    }
}

impl Engine for DeviceLossMonitor {
    fn device_name(&self) -> String {
        self.engine.device_name()
    }

    fn is_software(&self) -> bool {
        self.engine.is_software()
    }

    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<(), EngineError> {
        self.monitored(self.engine.load_scene(hash, package))
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

    fn sample(&self, request: &SampleWork) -> Result<Vec<DepthImage>, EngineError> {
        self.monitored(self.engine.sample(request))
    }

    fn upload(&self, set: &SampleSet) -> Result<Arc<dyn UploadedSet>, EngineError> {
        self.monitored(self.engine.upload(set))
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork) -> Result<Vec<View>, EngineError> {
        self.monitored(self.engine.reconstruct(set, work))
    }

    fn draw_direct(&self, work: &DirectWork) -> Result<Vec<View>, EngineError> {
        self.monitored(self.engine.draw_direct(work))
    }
}
