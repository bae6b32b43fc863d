//! What a coordinator shows, and with what: enough for a client to place its views.

use depth_image::{Aabb, Camera};
use glam::DVec3;

use crate::error::{WireError, required};
use crate::geometry::{bounds_from, bounds_to, camera_to, sample_cameras_from};
use crate::limits::text;
use crate::{SceneRef, proto};

/// The scene on offer.
#[derive(Debug, Clone, PartialEq)]
pub struct OfferStatus {
    /// By content.
    pub scene: SceneRef,
    /// Of sessions that bring none.
    pub sample_cameras: Vec<Camera>,
    /// What reconstruction looks at.
    pub volume: Aabb,
    /// The point of the source file's space that is the world's origin.
    pub origin_in_source: DVec3,
    /// Settings for sessions that have no wish.
    pub settings: OfferSettings,
}

/// Settings named as on the command line; empty where the client may choose.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OfferSettings {
    /// How views are reconstructed.
    pub method: String,
    /// How images are sampled.
    pub sampling: String,
    /// How samples are lit.
    pub lighting: String,
}

impl TryFrom<proto::SceneOffer> for OfferStatus {
    type Error = WireError;

    fn try_from(o: proto::SceneOffer) -> Result<Self, WireError> {
        let origin = DVec3::new(o.origin_in_source_x_m, o.origin_in_source_y_m, o.origin_in_source_z_m);
        if !origin.is_finite() {
            return Err(WireError::out_of_range("origin_in_source", origin, "finite"));
        }
        Ok(Self {
            scene: required(o.scene, "offer.scene")?.try_into()?,
            sample_cameras: sample_cameras_from(o.sample_cameras, 1)?,
            volume: bounds_from(required(o.volume, "offer.volume")?)?,
            origin_in_source: origin,
            settings: OfferSettings {
                method: text(o.reconstruction_method, "reconstruction_method")?,
                sampling: text(o.sampling_method, "sampling_method")?,
                lighting: text(o.lighting, "lighting")?,
            },
        })
    }
}

impl From<OfferStatus> for proto::SceneOffer {
    fn from(o: OfferStatus) -> Self {
        Self {
            scene: Some(o.scene.into()),
            sample_cameras: o.sample_cameras.iter().map(camera_to).collect(),
            volume: Some(bounds_to(&o.volume)),
            origin_in_source_x_m: o.origin_in_source.x,
            origin_in_source_y_m: o.origin_in_source.y,
            origin_in_source_z_m: o.origin_in_source.z,
            reconstruction_method: o.settings.method,
            sampling_method: o.settings.sampling,
            lighting: o.settings.lighting,
        }
    }
}
