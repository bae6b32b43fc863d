//! What the coordinator is given.

use std::time::Duration;

use bytes::Bytes;
use cluster::{OfferSettings, OfferStatus, SceneHash, SceneRef};
use depth_image::{Aabb, Camera, Illumination};
use glam::{DVec3, Vec3};

/// The coordinator's configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoordinatorConfig {
    /// Allows another bind address than loopback, without TLS.
    pub insecure_bind: bool,
    /// Says by reflection what services and messages there are.
    pub reflection: bool,
    /// How long one node may measure.
    pub measure_deadline: Duration,
    /// How long nodes may take to load a scene and get ready.
    pub ready_deadline: Duration,
    /// Sessions that may be open; more are refused with `RESOURCE_EXHAUSTED`.
    pub max_sessions: usize,
}

impl Default for CoordinatorConfig {
    fn default() -> Self {
        Self {
            insecure_bind: false,
            reflection: false,
            measure_deadline: Duration::from_secs(600),
            ready_deadline: Duration::from_secs(300),
            max_sessions: 1024,
        }
    }
}

/// The scene that the cluster shows. Its contents are the nodes' business.
#[derive(Debug, Clone)]
pub struct SceneOffer {
    /// Of the package.
    pub hash: SceneHash,
    /// The package.
    pub package: Bytes,
    /// Sample cameras for sessions that bring none.
    pub rig: Vec<Camera>,
    /// What reconstruction looks at, unless a session says otherwise.
    pub volume: Aabb,
    /// What rays meet that leave the scene.
    pub background_linear: Vec3,
    /// What lights the scene: compositors add what of it depends on the viewer.
    pub illumination: Illumination,
    /// The point of the source file's space that is the world's origin.
    pub origin_in_source: DVec3,
    /// For sessions that have no wish; empty where they may choose.
    pub settings: OfferSettings,
}

impl SceneOffer {
    /// Computes the hash.
    #[must_use]
    pub fn new(package: Bytes, rig: Vec<Camera>, volume: Aabb, background_linear: Vec3) -> Self {
        Self {
            hash: SceneHash::of(&package),
            package,
            rig,
            volume,
            background_linear,
            illumination: Illumination::default(),
            origin_in_source: DVec3::ZERO,
            settings: OfferSettings::default(),
        }
    }

    /// What clients are told.
    #[must_use]
    pub fn status(&self) -> OfferStatus {
        OfferStatus {
            scene: self.scene(),
            sample_cameras: self.rig.clone(),
            volume: self.volume,
            origin_in_source: self.origin_in_source,
            settings: self.settings.clone(),
        }
    }

    /// Its name and size.
    #[must_use]
    pub fn scene(&self) -> SceneRef {
        SceneRef { hash: self.hash.clone(), package_bytes: self.package.len() as u64 }
    }
}
