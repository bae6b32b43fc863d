//! What a session samples: its own wishes, else what came with the scene.

use depth_image::Camera;
use glam::UVec2;
use tonic::Status;
use wire::{SessionRequest, Workload};

use crate::SceneOffer;

/// Completes a request with the scene's defaults.
///
/// # Errors
/// For another scene than the one on offer, and cameras that cannot be.
pub(crate) fn workload_of(request: &SessionRequest, offer: &SceneOffer) -> Result<Workload, Status> {
    if request.scene.as_ref().is_some_and(|hash| *hash != offer.hash) {
        return Err(Status::not_found(format!("scene_hash: the scene on offer is {}", offer.hash)));
    }
    let cameras = if request.sample_cameras.is_empty() { &offer.rig } else { &request.sample_cameras };
    let sized = |camera: &Camera| request.sample_size_px.map_or(Ok(*camera), |size_px| resized(camera, size_px));
    let sample_cameras = cameras.iter().map(sized).collect::<Result<Vec<_>, _>>()?;
    if sample_cameras.is_empty() {
        return Err(Status::invalid_argument("sample_cameras is missing, and the scene came without a rig"));
    }
    Ok(Workload {
        scene: offer.scene(),
        sample_cameras,
        sampling: request.sampling.clone(),
        lighting: request.lighting.clone(),
        method: request.method.clone(),
        codec: request.codec.clone(),
        volume: request.volume.unwrap_or(offer.volume),
        background_linear: offer.background_linear,
        timeline: request.timeline,
        illumination: offer.illumination.clone(),
        refinement_steps: request.refinement_steps,
    })
}

/// The same field of view in another size.
fn resized(camera: &Camera, size_px: UVec2) -> Result<Camera, Status> {
    let Camera::Pinhole(camera) = camera;
    let camera = camera.resized(size_px);
    camera.validate().map_err(|error| Status::invalid_argument(format!("sample_image_size: {error}")))?;
    Ok(Camera::Pinhole(camera))
}
