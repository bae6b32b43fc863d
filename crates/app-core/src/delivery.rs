//! Views asked of a cluster as any client asks, and the time until all have arrived.

use std::time::Instant;

use client::{Client, Frame, Session, ViewRequest};
use cluster::limits::MAX_VIEWPOINTS;
use cluster::{OfferSettings, PolicyChoice, Quality, SessionRequest, Timeline};
use depth_image::{PinholeCamera, ViewPlanes};
use reconstruction::ReconstructionMethod;
use render::Lighting;
use sampling::SamplingMethod;

use crate::exit::BadInput;

/// Sides of sample images at a fallback, over those asked for.
const SAMPLE_SIDE_RATIO: f64 = 0.7;
/// Pictures a second at a fallback, over those asked for.
const FRAME_RATE_RATIO: f64 = 0.8;

/// A request for `views` a set: finished pictures of a still scene, without other planes, by the policy that is predicted
/// to be fastest, with the settings that the coordinator offers.
///
/// # Errors
/// There are no views.
pub fn request(offered: OfferSettings, views: &[PinholeCamera]) -> anyhow::Result<SessionRequest> {
    let OfferSettings { method, sampling, lighting } = offered;
    Ok(SessionRequest {
        scene: None,
        method: method.unwrap_or_else(|| ReconstructionMethod::default().to_string()),
        sampling: sampling.unwrap_or_else(|| SamplingMethod::default().to_string()),
        lighting: lighting.unwrap_or_else(|| Lighting::default().to_string()),
        codec: "lz4".to_owned(),
        sample_cameras: Vec::new(),
        sample_size_px: None,
        volume: None,
        typical_view: *views.first().ok_or_else(|| BadInput("no views are asked for".to_owned()))?,
        views_per_set: u32::try_from(views.len())?,
        planes: ViewPlanes::default(),
        timeline: Timeline::still(0.0),
        policy: PolicyChoice::Auto,
        forced_sampler_count: None,
        refinement_steps: 1,
        frames_per_s: None,
        fallbacks: Vec::new(),
        forced_tile_count: None,
        viewpoints: Vec::new(),
    })
}

/// The same at a rate, with fallbacks under overload.
#[must_use]
pub fn at_rate(request: SessionRequest, frames_per_s: f64) -> SessionRequest {
    let fallbacks = fallbacks(&request.lighting, &request.method);
    SessionRequest { frames_per_s: Some(frames_per_s), fallbacks, ..request }
}

/// Fallbacks under overload, in order: fewer rays of light, a coarser method, smaller sample images, fewer pictures a
/// second. Each includes those before it. Steps that the lighting and the method do not have are skipped.
fn fallbacks(lighting: &str, method: &str) -> Vec<Quality> {
    let fewer_rays = lighting.parse().ok().and_then(|lighting: Lighting| lighting.with_fewer_rays());
    let fewer_steps = method.parse().ok().and_then(|method: ReconstructionMethod| method.coarser());
    let (lighting, method) = (lighting.to_owned(), method.to_owned());
    let all = Quality { lighting, method, sample_side_ratio: 1.0, frame_rate_ratio: 1.0 };
    let dim = fewer_rays.map(|lighting| Quality { lighting: lighting.to_string(), ..all.clone() });
    let above = dim.clone().unwrap_or(all);
    let coarse = fewer_steps.map(|method| Quality { method: method.to_string(), ..above.clone() });
    let above = coarse.clone().unwrap_or(above);
    let small = Quality { sample_side_ratio: SAMPLE_SIDE_RATIO, ..above };
    let slow = Quality { frame_rate_ratio: FRAME_RATE_RATIO, ..small.clone() };
    dim.into_iter().chain(coarse).chain([small, slow]).collect()
}

/// Opens a session.
///
/// # Errors
/// The coordinator refuses.
pub async fn open(client: &Client, request: SessionRequest) -> anyhow::Result<Session> {
    Ok(client.open_session(request, |event| tracing::info!(?event, "session")).await?)
}

/// The views evenly thinned to as many as a session may name.
#[must_use]
pub fn viewpoints(views: &[PinholeCamera]) -> Vec<PinholeCamera> {
    views.iter().step_by(views.len().div_ceil(MAX_VIEWPOINTS).max(1)).copied().collect()
}

/// Asks for all views of all sets; frames are numbered set by set, and view by view in each. `received` is given each as it
/// comes, and is waited for. Gives the seconds from the request to the last frame, decoded and checksummed.
///
/// # Errors
/// The cluster fails, frames are missing, or `received` fails.
pub async fn receive(
    session: &Session,
    views: &[PinholeCamera],
    mut received: impl AsyncFnMut(Frame) -> anyhow::Result<()>,
) -> anyhow::Result<f64> {
    let start = Instant::now();
    let sets = session.plan().assignment.workload.timeline.set_count;
    let all = (0..sets).flat_map(|set_index| views.iter().map(move |&camera| (set_index, camera)));
    let requests = (0..).zip(all).map(|(frame, (set_index, camera))| ViewRequest { frame, set_index, camera });
    let mut incoming = session.render_views(requests.collect())?;
    while let Some(frame) = incoming.next().await {
        received(frame?).await?;
    }
    Ok(start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_reduced_first_and_the_frame_rate_last() {
        let ladder = fallbacks("soft 16, occlusion 8", "light_field_search:100");
        let steps: Vec<_> = ladder
            .iter()
            .map(|q| (q.lighting.as_str(), q.method.as_str(), q.sample_side_ratio, q.frame_rate_ratio))
            .collect();
        let (dim, coarse) = ("soft 4, occlusion 2", "light_field_search:50");
        assert_eq!(
            steps,
            [
                (dim, "light_field_search:100", 1.0, 1.0),
                (dim, coarse, 1.0, 1.0),
                (dim, coarse, 0.7, 1.0),
                (dim, coarse, 0.7, 0.8)
            ]
        );
    }

    #[test]
    fn steps_without_a_coarser_setting_are_skipped() {
        assert_eq!(fallbacks("phong", "mesh").len(), 2);
        assert_eq!(fallbacks("phong", "joint_carve").len(), 3);
        assert_eq!(fallbacks("of the future", "of the future").len(), 2);
    }
}
