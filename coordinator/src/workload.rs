//! The workload of a session: its own settings, completed with those of its scene.

use cluster::limits::MAX_CELLS;
use cluster::{SamplePlanes, SessionRequest, Workload};
use depth_image::{Aabb, Camera, PinholeCamera, ViewGroup};
use glam::UVec2;
use tonic::Status;

use crate::config::SceneOffer;
use crate::grpc_status::refusal;
use crate::schedule::{ChoiceError, first_indices};

/// Completes a request with the scene's defaults. A node tells which planes its method needs.
///
/// # Errors
/// For invalid cameras.
pub(crate) fn workload_of(request: &SessionRequest, offer: &SceneOffer) -> Result<Workload, Status> {
    let volume = request.volume.unwrap_or(offer.volume);
    let cells = cells_of(request, offer, &volume)?;
    let cell_first_indices = first_indices(&cells);
    let cameras = match (cells.is_empty(), request.sample_cameras.is_empty()) {
        (false, false) => return Err(Status::invalid_argument("viewpoints: sample_cameras are given, too")),
        (false, true) => cells.concat(),
        (true, false) => request.sample_cameras.clone(),
        (true, true) => offer.rig.clone(),
    };
    let sized = |camera: &Camera| request.sample_size_px.map_or(Ok(*camera), |size_px| resized(camera, size_px));
    let sample_cameras = cameras.iter().map(sized).collect::<Result<Vec<_>, _>>()?;
    if sample_cameras.is_empty() {
        return Err(Status::invalid_argument("sample_cameras is missing, and the scene came without a rig"));
    }
    Ok(Workload {
        scene: offer.scene(),
        sample_cameras,
        cell_first_indices,
        sampling: request.sampling.clone(),
        lighting: request.lighting.clone(),
        planes: SamplePlanes::default(),
        volume,
        background: offer.background,
        timeline: request.timeline,
        illumination: offer.illumination.clone(),
        refinement_steps: request.refinement_steps,
    })
}

/// The sample cameras of each view cell of the session's viewpoints, as if it were alone, in the size of the offered ones.
fn cells_of(request: &SessionRequest, offer: &SceneOffer, volume: &Aabb) -> Result<Vec<Vec<Camera>>, Status> {
    let offered = offer.rig.first().map(|Camera::Pinhole(camera)| camera.size_px);
    let size_px = request.sample_size_px.or(offered).unwrap_or(request.typical_view.size_px);
    let mut groups = Vec::new();
    ViewGroup::add(&mut groups, &request.viewpoints, volume);
    if groups.len() > MAX_CELLS {
        return Err(refusal(&ChoiceError::Cells { cells: groups.len() }));
    }
    let checked = |camera: PinholeCamera| {
        let usable = camera.validate().map(|()| Camera::Pinhole(camera));
        usable.map_err(|error| Status::invalid_argument(format!("viewpoints: {error}")))
    };
    let cameras = |group: &ViewGroup| group.sample_cameras(size_px).into_iter().map(checked).collect();
    groups.iter().map(cameras).collect()
}

/// The same field of view in another size.
fn resized(camera: &Camera, size_px: UVec2) -> Result<Camera, Status> {
    let Camera::Pinhole(camera) = camera;
    let camera = camera.resized(size_px);
    camera.validate().map_err(|error| Status::invalid_argument(format!("sample_image_size: {error}")))?;
    Ok(Camera::Pinhole(camera))
}
