//! A device that may be lost: whoever serves by it hears of that at once.

use std::sync::Arc;

use depth_image::{DepthImage, View};
use tokio::sync::watch;

use crate::{DirectWork, Engine, EngineError, SampleSet, SampleWork, UploadedSet, ViewWork};

/// Passes everything on to an engine, and remembers when it says that its device is lost.
#[derive(Clone)]
pub struct Watched {
    engine: Arc<dyn Engine>,
    lost: watch::Sender<Option<String>>,
}

impl Watched {
    /// Of an engine whose device is there.
    #[must_use]
    pub fn new(engine: Arc<dyn Engine>) -> Self {
        Self { engine, lost: watch::Sender::new(None) }
    }

    /// Resolves when the device is lost; says how.
    pub async fn lost(&self) -> String {
        let mut lost = self.lost.subscribe();
        // The sender is ours: it lasts as long as this.
        let reason = lost.wait_for(Option::is_some).await.ok().and_then(|reason| reason.clone());
        reason.unwrap_or_default()
    }

    fn noted<T>(&self, done: Result<T, EngineError>) -> Result<T, EngineError> {
        if let Err(EngineError::Lost(reason)) = &done {
            self.lost.send_replace(Some(reason.clone()));
        }
        done
    }
}

impl Engine for Watched {
    fn device_name(&self) -> String {
        self.engine.device_name()
    }

    fn is_software(&self) -> bool {
        self.engine.is_software()
    }

    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<f64, EngineError> {
        self.noted(self.engine.load_scene(hash, package))
    }

    fn has_scene(&self, hash: &str) -> bool {
        self.engine.has_scene(hash)
    }

    fn samples_alone(&self, sampling: &str) -> Result<bool, EngineError> {
        self.noted(self.engine.samples_alone(sampling))
    }

    fn samples_in_order(&self, sampling: &str) -> Result<bool, EngineError> {
        self.noted(self.engine.samples_in_order(sampling))
    }

    fn sample(&self, request: &SampleWork) -> Result<Vec<DepthImage>, EngineError> {
        self.noted(self.engine.sample(request))
    }

    fn upload(&self, set: &SampleSet) -> Result<Arc<dyn UploadedSet>, EngineError> {
        self.noted(self.engine.upload(set))
    }

    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork) -> Result<Vec<View>, EngineError> {
        self.noted(self.engine.reconstruct(set, work))
    }

    fn draw_direct(&self, work: &DirectWork) -> Result<Vec<View>, EngineError> {
        self.noted(self.engine.draw_direct(work))
    }
}
