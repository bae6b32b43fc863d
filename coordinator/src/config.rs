//! The coordinator's configuration, and the scene that it offers.

use bytes::Bytes;
use cluster::{OfferSettings, OfferStatus, SceneHash, SceneRef};
use depth_image::{Aabb, Camera, Illumination};
use glam::{DVec3, Vec3};

/// The coordinator's configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoordinatorConfig {
    /// Allows another bind address than loopback, without TLS.
    pub insecure_bind: bool,
    /// Serves the reflection service.
    pub reflection: bool,
    /// Sessions that may be open; more are refused with `RESOURCE_EXHAUSTED`.
    pub max_sessions: usize,
}

impl Default for CoordinatorConfig {
    fn default() -> Self {
        Self { insecure_bind: false, reflection: false, max_sessions: 1024 }
    }
}

/// The scene that the cluster shows. Only nodes look into its package.
#[derive(Debug, Clone)]
pub struct SceneOffer {
    /// The content hash of the package.
    pub hash: SceneHash,
    /// The package.
    pub package: Bytes,
    /// Sample cameras for sessions that bring none.
    pub rig: Vec<Camera>,
    /// The volume that is reconstructed, unless a session brings its own.
    pub volume: Aabb,
    /// The colour of rays that leave the scene.
    pub background_linear: Vec3,
    /// Lamps and environment: compositors add the highlights, which depend on the viewer.
    pub illumination: Illumination,
    /// The point of the source file's space that is the world's origin.
    pub origin_in_source: DVec3,
    /// Defaults of sessions.
    pub settings: OfferSettings,
}

impl SceneOffer {
    /// The offer as clients see it.
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

    /// The name and size of the scene.
    #[must_use]
    pub fn scene(&self) -> SceneRef {
        SceneRef { hash: self.hash.clone(), package_bytes: self.package.len() as u64 }
    }
}
