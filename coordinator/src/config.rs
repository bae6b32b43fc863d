//! The coordinator's configuration, and the scenes that it offers.

use bytes::Bytes;
use cluster::limits::MAX_SCENES;
use cluster::{CommonCell, OfferSettings, OfferStatus, SceneHash, SceneRef};
use depth_image::{Aabb, Camera, CubeGrid, Environment, Illumination, LightFieldCamera, SourceSpace};
use planner::{Budget, Row};
use tonic::Status;

/// The coordinator's configuration.
#[derive(Debug, Clone)]
pub struct CoordinatorConfig {
    /// Allows another bind address than loopback, without TLS.
    pub insecure_bind: bool,
    /// Sessions that may be open; more are refused with `RESOURCE_EXHAUSTED`.
    pub max_sessions: usize,
    /// Workloads that may be open, from 1 to 64; more are refused with `RESOURCE_EXHAUSTED`.
    pub max_workloads: usize,
    /// The budget of sessions that state none.
    pub budget: Option<Budget>,
    /// The share of compositors' time that audits of promises may take, from 0 to 0.5.
    pub audit_time_ratio: f64,
    /// The rows among which budgets choose in a light, the coarsest samples first and direct drawing in that light last.
    pub rows: fn(&str) -> Vec<Row>,
}

impl Default for CoordinatorConfig {
    fn default() -> Self {
        Self {
            insecure_bind: false,
            max_sessions: 1024,
            max_workloads: 8,
            budget: None,
            audit_time_ratio: 0.01,
            rows: |_| Vec::new(),
        }
    }
}

/// A scene that the cluster shows. Only nodes look into its package.
#[derive(Debug, Clone)]
pub struct SceneOffer {
    /// The name by which sessions ask for it.
    pub name: String,
    /// The content hash of the package.
    pub hash: SceneHash,
    /// The package.
    pub package: Bytes,
    /// Sample cameras for sessions that bring none.
    pub rig: Vec<Camera>,
    /// A layered depth cube of it, for sessions that are sampled so.
    pub cube: Option<OfferedCube>,
    /// Its mirrors, for sessions that follow mirrors.
    pub mirrors: Vec<OfferedCell>,
    /// A layered depth cube of it, for what the images of a still scene leave unknown.
    pub base: Option<(CommonCell, CubeGrid)>,
    /// Its blocks, cells of one grid, for sessions that are made from samples alone.
    pub blocks: Vec<OfferedCell>,
    /// The rig's images get the size that suits the views of a session that names none.
    pub fits_views: bool,
    /// The volume that is reconstructed, unless a session brings its own.
    pub volume: Aabb,
    /// Radiance of rays that leave the scene, by their direction.
    pub background: Environment,
    /// Lamps and environment: compositors add the highlights, which depend on the viewer.
    pub illumination: Illumination,
    /// The space of the scene's file.
    pub source_space: SourceSpace,
    /// Defaults of sessions.
    pub settings: OfferSettings,
    /// Seconds after which a scene that moves is as at its start; `None` for one that never moves.
    pub period_s: Option<f64>,
}

/// A mirror or a block of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct OfferedCell {
    /// Its box, and how its images are sampled.
    pub cell: CommonCell,
    /// Sample cameras for what a mirror shows, of sizes in proportion; or those of a block.
    pub cameras: Vec<Camera>,
}

/// A way to sample a scene whose cameras depend on no viewer.
#[derive(Debug, Clone, PartialEq)]
pub struct OfferedCube {
    /// The sampling method.
    pub sampling: String,
    /// The lines along which it samples.
    pub grid: CubeGrid,
    /// The lines of its light field, if it has one.
    pub light_field: Option<LightFieldCamera>,
    /// The sampling method with the rig's cameras, for sessions whose views are drawn directly: they share no workload with those of
    /// the cube.
    pub beside: String,
}

/// The scenes that a coordinator offers, at least one; sessions that name none get the first.
#[derive(Debug, Clone)]
pub struct SceneOffers(Vec<SceneOffer>);

/// Why scenes cannot be offered together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum OfferError {
    #[error("scene: there is none")]
    None,
    #[error("scene: {count} are given, at most {MAX_SCENES} can be offered")]
    TooMany { count: usize },
    #[error("scene {name} is given twice")]
    Twice { name: String },
}

impl SceneOffers {
    /// # Errors
    /// Without scenes, with too many, and with two of one name or one content.
    pub fn new(offers: Vec<SceneOffer>) -> Result<Self, OfferError> {
        match offers.len() {
            0 => return Err(OfferError::None),
            count if count > MAX_SCENES => return Err(OfferError::TooMany { count }),
            _ => (),
        }
        for (place, offer) in offers.iter().enumerate() {
            let mut before = offers[..place].iter();
            if let Some(other) = before.find(|other| other.name == offer.name || other.hash == offer.hash) {
                return Err(OfferError::Twice { name: other.name.clone() });
            }
        }
        Ok(Self(offers))
    }

    /// All offers in their order.
    pub fn iter(&self) -> impl Iterator<Item = &SceneOffer> {
        self.0.iter()
    }

    /// The offer of a name or a hash; the first where none is named.
    pub(crate) fn find(&self, scene: Option<&str>) -> Result<&SceneOffer, Status> {
        let named = match scene {
            Some(scene) => self.iter().find(|offer| scene == offer.name || scene == offer.hash.as_str()),
            None => self.0.first(),
        };
        named.ok_or_else(|| {
            let names: Vec<&str> = self.iter().map(|offer| offer.name.as_str()).collect();
            Status::not_found(format!("scene: {} is not on offer; {} are", scene.unwrap_or_default(), names.join(", ")))
        })
    }
}

impl From<SceneOffer> for SceneOffers {
    fn from(offer: SceneOffer) -> Self {
        Self(vec![offer])
    }
}

impl SceneOffer {
    /// The offer as clients see it.
    #[must_use]
    pub fn status(&self) -> OfferStatus {
        OfferStatus {
            name: self.name.clone(),
            scene: self.scene(),
            sample_cameras: self.rig.clone(),
            volume: self.volume,
            source_space: self.source_space,
            settings: self.settings.clone(),
            period_s: self.period_s,
        }
    }

    /// The name and size of the scene.
    #[must_use]
    pub fn scene(&self) -> SceneRef {
        SceneRef { hash: self.hash.clone(), package_bytes: self.package.len() as u64 }
    }
}
