//! The boundary to the device.

use std::any::Any;
use std::sync::Arc;

use cluster::Refinement;
use depth_image::{Aabb, Camera, DepthImage, Illumination, PinholeCamera, View, ViewPlanes};
use glam::Vec3;
use tonic::Status;

/// What a node can do on its device. Calls block; services run them on blocking threads. Methods,
/// sampling and lighting are text, as on the command line, parsed here.
pub trait Engine: Send + Sync + 'static {
    /// As every reported time names it.
    fn device_name(&self) -> String;
    /// Whether the device is a CPU.
    fn is_software(&self) -> bool;
    /// Loads a scene package, whose bytes have been checked against the hash, and keeps it under it;
    /// gives the seconds spent.
    ///
    /// # Errors
    /// Where the package cannot be read or the device cannot hold it.
    fn load_scene(&self, hash: &str, package: &[u8]) -> Result<f64, EngineError>;
    /// Whether [`Engine::load_scene`] has been here.
    fn has_scene(&self, hash: &str) -> bool;
    /// Whether a sampling method takes an image only after those before it, so that a set stays on one node.
    ///
    /// # Errors
    /// For a method it does not know.
    fn samples_in_order(&self, sampling: &str) -> Result<bool, EngineError>;
    /// Whether an image depends on its own camera alone, so that it can be cut into tiles.
    ///
    /// # Errors
    /// For a method it does not know.
    fn samples_alone(&self, sampling: &str) -> Result<bool, EngineError>;
    /// The wanted images of a set, in their order.
    ///
    /// # Errors
    /// For settings it does not know, a scene it has not, or a device that fails.
    fn sample(&self, request: &SampleWork) -> Result<Vec<DepthImage>, EngineError>;
    /// Makes a set ready to be reconstructed from.
    ///
    /// # Errors
    /// For images it cannot take, or a device that fails.
    fn upload(&self, set: &SampleSet) -> Result<Arc<dyn UploadedSet>, EngineError>;
    /// One view a camera, in one submission.
    ///
    /// # Errors
    /// For settings it does not know, or a device that fails.
    fn reconstruct(&self, set: &dyn UploadedSet, work: &ViewWork) -> Result<Vec<View>, EngineError>;
    /// One view a camera, from the scene itself.
    ///
    /// # Errors
    /// For settings it does not know, a scene it has not, or a device that fails.
    fn draw_direct(&self, work: &DirectWork) -> Result<Vec<View>, EngineError>;
}

/// A sample set on the device; the engine knows what it is.
pub trait UploadedSet: Any + Send + Sync {}

/// Images to sample.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleWork {
    /// A loaded scene.
    pub scene_hash: String,
    /// Of the whole set, in its order: what an image shows may depend on the cameras before its own.
    pub cameras: Vec<Camera>,
    /// Which of them are to be sampled.
    pub wanted: Vec<u32>,
    /// The sampling method.
    pub sampling: String,
    /// The reconstruction method, which says what planes images need.
    pub method: String,
    /// The lighting.
    pub lighting: String,
    /// Where animation stands.
    pub scene_time_s: f32,
    /// Where it stood in the set that this one keeps on to the samples of, where the sampling method settles.
    pub settled_at_s: Option<f32>,
    /// How far its light has come. Any step may be asked for first, or alone.
    pub refinement: Refinement,
}

/// The images of one set.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleSet {
    /// One a sample camera, in their order.
    pub images: Vec<DepthImage>,
    /// What reconstruction looks at.
    pub volume: Aabb,
    /// What rays meet that leave the scene.
    pub background_linear: Vec3,
    /// Of the scene: what highlights are made of, in the order of the images' visibility.
    pub illumination: Illumination,
    /// The lighting that the images were sampled with: whose formula highlights follow.
    pub lighting: String,
}

/// Views to reconstruct.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewWork {
    /// All of one size.
    pub cameras: Vec<PinholeCamera>,
    /// The reconstruction method.
    pub method: String,
    /// Beside colour.
    pub planes: ViewPlanes,
}

/// Views to draw from the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectWork {
    /// A loaded scene.
    pub scene_hash: String,
    /// All of one size.
    pub cameras: Vec<PinholeCamera>,
    /// The lighting.
    pub lighting: String,
    /// Where animation stands.
    pub scene_time_s: f32,
    /// Beside colour.
    pub planes: ViewPlanes,
}

/// Why the device did not do it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EngineError {
    /// A setting that cannot be used.
    #[error("{field}: {reason}")]
    InvalidArgument {
        /// Which.
        field: &'static str,
        /// Why.
        reason: String,
    },
    /// A scene that was never loaded.
    #[error("scene {hash} is not loaded")]
    UnknownScene {
        /// Which.
        hash: String,
    },
    /// The device, or its memory, could not do this one thing.
    #[error("device: {0}")]
    Device(String),
    /// The device does nothing any more.
    #[error("device lost: {0}")]
    Lost(String),
}

impl From<EngineError> for Status {
    fn from(error: EngineError) -> Self {
        let text = error.to_string();
        match error {
            EngineError::InvalidArgument { .. } => Self::invalid_argument(text),
            EngineError::UnknownScene { .. } => Self::failed_precondition(text),
            EngineError::Device(_) => Self::internal(text),
            // Another node's device can do it.
            EngineError::Lost(_) => Self::unavailable(text),
        }
    }
}
