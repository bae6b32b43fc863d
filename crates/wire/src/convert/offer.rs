//! Scenes on offer.

use cluster::{OfferSettings, OfferStatus};
use glam::DVec3;

use super::geometry::{bounds_from, bounds_to, camera_to, sample_cameras_from};
use crate::error::{WireError, required};
use crate::proto;

impl TryFrom<proto::SceneOffer> for OfferStatus {
    type Error = WireError;

    fn try_from(o: proto::SceneOffer) -> Result<Self, WireError> {
        let setting = |text: String| (!text.is_empty()).then_some(text);
        let offer = Self {
            scene: required(o.scene, "offer.scene")?.try_into()?,
            sample_cameras: sample_cameras_from(o.sample_cameras, 1)?,
            volume: bounds_from(required(o.volume, "offer.volume")?)?,
            origin_in_source: DVec3::new(o.origin_in_source_x_m, o.origin_in_source_y_m, o.origin_in_source_z_m),
            settings: OfferSettings {
                method: setting(o.reconstruction_method),
                sampling: setting(o.sampling_method),
                lighting: setting(o.lighting),
            },
        };
        offer.validate()?;
        Ok(offer)
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
            reconstruction_method: o.settings.method.unwrap_or_default(),
            sampling_method: o.settings.sampling.unwrap_or_default(),
            lighting: o.settings.lighting.unwrap_or_default(),
        }
    }
}
