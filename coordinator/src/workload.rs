//! The workload of a session: its own settings, completed with those of its scene.

use cluster::limits::{MAX_CELLS, MAX_TILES};
use cluster::{CommonCell, DIRECT, SamplePlanes, SessionRequest, Workload};
use depth_image::{Aabb, Camera, PinholeCamera, SampleCamera, ViewCell, ViewGroup};
use glam::UVec2;
use tonic::Status;

use crate::config::{OfferedCube, SceneOffer};
use crate::light_samples::LightSamples;
use crate::schedule::ChoiceError;

/// Texels of a sample image a pixel of a view, each way: what brings most for its cost (docs/benchmarks.md).
const SAMPLE_DENSITY: f32 = 2.0;
/// The most texels of a set of images whose size follows the views: a software device samples them in about a second.
const MAX_FITTING_TEXELS: usize = 1 << 20;
/// The same of samples of light, whose time is measured.
const MAX_LIGHT_TEXELS: usize = 1 << 24;
/// Texels of all images of a mirror cell, over those of one sample image: a mirror shows all directions.
const MIRROR_DENSITY: f32 = 2.2;
/// The same of all mirror cells together, which every view needs.
const MIRRORS_DENSITY: f32 = 4.4;
/// Steps of √2 by which images are smaller than the offered ones at most.
const LEAST_STEPS: f32 = -2.0;

/// Completes a request with the scene's defaults. A node tells which planes its method needs. `light` are the samples
/// of light where they follow the views.
///
/// # Errors
/// For invalid cameras.
pub(crate) fn workload_of(
    request: &SessionRequest,
    offer: &SceneOffer,
    light: LightSamples,
) -> Result<Workload, Status> {
    let volume = request.volume.unwrap_or(offer.volume);
    let offered = offer.cube.as_ref().filter(|cube| cube.sampling == request.sampling);
    let drawn = offered.filter(|_| request.method == DIRECT);
    let cube = offered.filter(|_| drawn.is_none()).map(|cube| checked_cube(request, cube)).transpose()?;
    let size_px = session_size_px(request, offer, light);
    let cells = if cube.is_some() { Vec::new() } else { cells_of(request, offer, size_px, &volume)? };
    let sample_cameras = match cube {
        Some(cube) => {
            let parallel = cube.grid.cameras().map(SampleCamera::from).into_iter();
            parallel.chain(cube.light_field.map(SampleCamera::from)).collect()
        }
        None => sample_cameras_of(request, offer, size_px, light, !cells.is_empty())?,
    };
    let workload = Workload {
        scene: offer.scene(),
        sample_cameras,
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: drawn.map_or(&request.sampling, |cube| &cube.beside).clone(),
        lighting: request.lighting.clone(),
        planes: SamplePlanes::default(),
        volume,
        background: offer.background,
        timeline: request.timeline,
        illumination: offer.illumination.clone(),
        refinement_steps: request.refinement_steps,
        traced_pixel_count: None,
    };
    let workload = if cells.is_empty() { workload } else { workload.with_view_cells(cells) };
    let blocks = blocks_of(request, offer, &workload)?;
    if !blocks.is_empty() {
        return Ok(workload.with_common_cells(blocks));
    }
    let base = base_of(request, offer, &workload);
    let mirrors = mirrors_of(request, offer, &workload)?;
    Ok(workload.with_common_cells(mirrors.into_iter().chain(base).collect()))
}

/// An offered cube, which depends on no viewer.
fn checked_cube<'o>(request: &SessionRequest, cube: &'o OfferedCube) -> Result<&'o OfferedCube, Status> {
    let refused = [
        (request.timeline.moves(), "timeline: scenes that move"),
        (!request.sample_cameras.is_empty(), "sample_cameras: sessions with cameras of their own"),
        (request.sample_size_px.is_some(), "sample_image_size: images of a chosen size"),
        (request.volume.is_some(), "volume: parts of the scene"),
    ];
    match refused.into_iter().find(|(is_asked, _)| *is_asked) {
        Some((_, what)) => Err(Status::invalid_argument(format!("{what} are not sampled by {}", cube.sampling))),
        None => Ok(cube),
    }
}

/// The sample cameras of a session without a cube; none with view cells, whose cameras follow from viewpoints.
fn sample_cameras_of(
    request: &SessionRequest,
    offer: &SceneOffer,
    size_px: Option<UVec2>,
    light: LightSamples,
    has_cells: bool,
) -> Result<Vec<SampleCamera>, Status> {
    let cameras = match (has_cells, request.sample_cameras.is_empty()) {
        (true, false) => return Err(Status::invalid_argument("viewpoints: sample_cameras are given, too")),
        (true, true) => return Ok(Vec::new()),
        (false, false) => &request.sample_cameras,
        (false, true) => &offer.rig,
    };
    if cameras.is_empty() {
        return Err(Status::invalid_argument("sample_cameras is missing, and the scene came without a rig"));
    }
    let mut cameras = cameras.clone();
    if let Some(size_px) = size_px {
        let count = light.camera_count.filter(|_| chooses_light_samples(request, offer));
        let references: Vec<PinholeCamera> = cameras.iter().map(|camera| *camera.reference()).collect();
        match count.zip(ViewCell::between(&references)) {
            Some((count, cell)) => {
                cameras = cell.nested_cameras(count, size_px).into_iter().map(Camera::Pinhole).collect();
            }
            None => cameras.iter_mut().for_each(|camera| *camera = camera.resized(size_px)),
        }
        let valid = cameras.iter().try_for_each(Camera::validate);
        valid.map_err(|error| Status::invalid_argument(format!("sample_image_size: {error}")))?;
    }
    Ok(cameras.into_iter().map(SampleCamera::Depth).collect())
}

/// The scene's mirrors, where the session follows them, with images of about [`MIRROR_DENSITY`].
fn mirrors_of(
    request: &SessionRequest,
    offer: &SceneOffer,
    workload: &Workload,
) -> Result<Vec<(CommonCell, Vec<SampleCamera>)>, Status> {
    // In a cube mirrors show its own samples.
    if !request.follows_mirrors || request.method == DIRECT || workload.samples_cube() {
        return Ok(Vec::new());
    }
    let image_texels = workload.sample_cameras.first().map_or(1, SampleCamera::pixel_count);
    let texels = image_texels as f32 * MIRROR_DENSITY.min(MIRRORS_DENSITY / offer.mirrors.len().max(1) as f32);
    let mut mirrors = Vec::with_capacity(offer.mirrors.len());
    for mirror in &offer.mirrors {
        let cameras = Camera::resized_together(&mirror.cameras, texels, MAX_TILES);
        let valid = cameras.iter().try_for_each(Camera::validate);
        valid.map_err(|error| Status::internal(format!("mirrors of scene {}: {error}", offer.name)))?;
        mirrors.push((mirror.cell.clone(), cameras.into_iter().map(SampleCamera::Depth).collect()));
    }
    Ok(mirrors)
}

/// The scene's base, where the session is made from depth images of the whole scene that hold still.
fn base_of(
    request: &SessionRequest,
    offer: &SceneOffer,
    workload: &Workload,
) -> Option<(CommonCell, Vec<SampleCamera>)> {
    if request.method == DIRECT || request.volume.is_some() || workload.samples_cube() || workload.timeline.moves() {
        return None;
    }
    let (cell, grid) = offer.base.as_ref()?;
    Some((cell.clone(), grid.cameras().map(SampleCamera::from).to_vec()))
}

/// The scene's blocks, where the session is made from depth images of the whole scene. Their images are as large as those of view cells.
fn blocks_of(
    request: &SessionRequest,
    offer: &SceneOffer,
    workload: &Workload,
) -> Result<Vec<(CommonCell, Vec<SampleCamera>)>, Status> {
    let Some(first) = workload.sample_cameras.first().and_then(SampleCamera::depth) else { return Ok(Vec::new()) };
    if request.method == DIRECT || request.volume.is_some() || request.takes_light {
        return Ok(Vec::new());
    }
    let mut blocks = Vec::with_capacity(offer.blocks.len());
    for block in &offer.blocks {
        let cameras: Vec<Camera> = block.cameras.iter().map(|camera| camera.resized(first.size_px())).collect();
        let valid = cameras.iter().try_for_each(Camera::validate);
        valid.map_err(|error| Status::internal(format!("blocks of scene {}: {error}", offer.name)))?;
        blocks.push((block.cell.clone(), cameras.into_iter().map(SampleCamera::Depth).collect()));
    }
    Ok(blocks)
}

/// The sample cameras of each view cell of the session's viewpoints, as if it were alone, in the size of the offered ones.
fn cells_of(
    request: &SessionRequest,
    offer: &SceneOffer,
    size_px: Option<UVec2>,
    volume: &Aabb,
) -> Result<Vec<Vec<SampleCamera>>, Status> {
    let offered = offer.rig.first().map(Camera::size_px);
    let size_px = size_px.or(offered).unwrap_or(request.typical_view.size_px);
    let mut groups = Vec::new();
    ViewGroup::add(&mut groups, &request.viewpoints, volume);
    if groups.len() > MAX_CELLS {
        return Err(ChoiceError::Cells { cells: groups.len() }.into());
    }
    let cells: Vec<Vec<PinholeCamera>> = groups.iter().map(|group| group.sample_cameras(size_px)).collect();
    let valid = cells.iter().flatten().try_for_each(PinholeCamera::validate);
    valid.map_err(|error| Status::invalid_argument(format!("viewpoints: {error}")))?;
    Ok(cells.into_iter().map(|cell| cell.into_iter().map(SampleCamera::from).collect()).collect())
}

/// The size of a session's images; `None` where the offer's is fixed, or the session brings its own cameras.
fn session_size_px(request: &SessionRequest, offer: &SceneOffer, light: LightSamples) -> Option<UVec2> {
    if !has_fitted_size(request, offer) {
        return request.sample_size_px;
    }
    let (density, most_texels) = match request.takes_light {
        true => (light.density, MAX_LIGHT_TEXELS),
        false => (SAMPLE_DENSITY, MAX_FITTING_TEXELS),
    };
    size_of_density(&offer.rig, &request.typical_view, density, most_texels)
}

/// Whether the size of a session's images follows its views.
fn has_fitted_size(request: &SessionRequest, offer: &SceneOffer) -> bool {
    offer.fits_views && request.sample_cameras.is_empty() && request.sample_size_px.is_none()
}

/// Whether the number and the density of a session's samples of light may be chosen; in view cells, the density.
pub(crate) fn chooses_light_samples(request: &SessionRequest, offer: &SceneOffer) -> bool {
    request.takes_light && has_fitted_size(request, offer)
}

/// The size of offered images that makes them as dense as a view, for samples of light. `None` without images or with a
/// degenerate view.
pub(crate) fn light_size_px(rig: &[Camera], view: &PinholeCamera) -> Option<UVec2> {
    size_of_density(rig, view, LightSamples::FULL.density, MAX_LIGHT_TEXELS)
}

/// The size of offered images that makes them about `density` times as dense as a view. Sizes are whole steps of √2 apart, so
/// that sessions of similar views share their samples. `None` without images or with a degenerate view.
fn size_of_density(rig: &[Camera], view: &PinholeCamera, density: f32, most_texels: usize) -> Option<UVec2> {
    let offered = rig.first()?.reference();
    let wanted = density * view.focal_px.min_element() / offered.focal_px.min_element();
    let most = (most_texels as f32 / (offered.pixel_count() * rig.len()) as f32).log2().floor();
    let steps = (2.0 * wanted.log2()).round().max(LEAST_STEPS).min(most);
    let size_px = (offered.size_px.as_vec2() * (0.5 * steps).exp2()).round();
    steps.is_finite().then(|| size_px.as_uvec2().max(UVec2::ONE))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(width: u32, height: u32) -> PinholeCamera {
        let size_px = UVec2::new(width, height);
        PinholeCamera::looking_at(glam::Vec3::Z, glam::Vec3::ZERO, glam::Vec3::Y, 0.8, size_px)
    }

    #[test]
    fn images_follow_the_density_of_views_in_steps_up_to_a_bound() {
        let rig = vec![Camera::Pinhole(camera(400, 300)); 4];
        let size = |width, height| {
            size_of_density(&rig, &camera(width, height), SAMPLE_DENSITY, MAX_FITTING_TEXELS)
                .map(|size| (size.x, size.y))
        };
        assert_eq!(size(200, 150), Some((400, 300)));
        assert_eq!(size(210, 160), Some((400, 300)), "similar views share their samples");
        assert_eq!(size(120, 90), Some((283, 212)));
        assert_eq!(size(16, 12), Some((200, 150)), "the least");
        for (width, height) in [(400, 300), (1280, 720), (8192, 8192)] {
            assert_eq!(size(width, height), Some((566, 424)), "the most");
        }
        let texels = |cameras: usize| {
            let rig = vec![Camera::Pinhole(camera(400, 300)); cameras];
            size_of_density(&rig, &camera(4000, 3000), SAMPLE_DENSITY, MAX_FITTING_TEXELS)
                .map(|size| size.element_product() as usize * cameras)
        };
        assert!((1..=40).all(|cameras| texels(cameras).is_some_and(|texels| texels < MAX_FITTING_TEXELS + 4096)));
        assert_eq!(light_size_px(&[], &camera(4, 3)), None);
        assert_eq!(size_of_density(&rig, &camera(400, 300), 1.0, MAX_LIGHT_TEXELS), Some(UVec2::new(400, 300)));
        assert_eq!(size_of_density(&rig, &camera(800, 600), 0.5, MAX_LIGHT_TEXELS), Some(UVec2::new(400, 300)));
    }
}
