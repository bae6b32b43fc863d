//! Views asked of a cluster as any client asks, and the time until all have arrived.

use std::sync::Arc;
use std::time::Instant;

use client::{Client, Frame, Session, ViewRequest};
use cluster::limits::{MAX_VIEWPOINTS, MAX_VIEWS_PER_SET};
use cluster::{BudgetRequest, DIRECT, OfferSettings, PolicyChoice, Quality, SessionRequest, Timeline};
use depth_image::{LightCacheQuality, PinholeCamera, ViewPlanes};
use reconstruction::ReconstructionMethod;
use render::Lighting;
use sampling::SamplingMethod;

use crate::exit::BadInput;

/// Sides of sample images at a fallback, over those asked for.
const SAMPLE_SIDE_RATIO: f64 = 0.7;
/// Pictures a second at a fallback, over those asked for.
const FRAME_RATE_RATIO: f64 = 0.8;

/// What a session asks for beside settings and views.
#[derive(Debug, Clone, Default)]
pub struct Terms {
    /// The policy; without one, that which is predicted to be fastest.
    pub policy: PolicyChoice,
    /// The budget, which chooses the method unless that is named.
    pub budget: BudgetRequest,
}

impl From<PolicyChoice> for Terms {
    fn from(policy: PolicyChoice) -> Self {
        Self { policy, ..Self::default() }
    }
}

/// A request for `views` a set: finished pictures of a still scene, without other planes, with the settings that the coordinator
/// offers.
///
/// # Errors
/// There are no views.
pub fn request(
    offered: OfferSettings,
    terms: impl Into<Terms>,
    views: &[PinholeCamera],
) -> anyhow::Result<SessionRequest> {
    let OfferSettings { method, sampling, lighting } = offered;
    let terms = terms.into();
    let lighting = lighting.unwrap_or_else(|| Lighting::default().to_string());
    let method = method.unwrap_or_else(|| default_method(&lighting, &terms));
    let takes_light = takes_light_from_samples(&method);
    Ok(SessionRequest {
        scene: None,
        sampling: sampling.unwrap_or_else(|| default_sampling(&lighting).to_string()),
        // Where surfaces come from the scene, so does what mirrors show.
        follows_mirrors: !takes_light && lighting.parse().is_ok_and(|lighting: Lighting| lighting.reflections() > 0),
        takes_light,
        method,
        lighting,
        codec: "lz4".to_owned(),
        sample_cameras: Vec::new(),
        sample_size_px: None,
        volume: None,
        typical_view: *views.first().ok_or_else(|| BadInput("no views are asked for".to_owned()))?,
        // Plans need no more views: a client requests a few thousand at a time.
        views_per_set: views.len().min(MAX_VIEWS_PER_SET as usize) as u32,
        planes: ViewPlanes::default(),
        auto_exposure: false,
        timeline: Timeline::still(0.0),
        policy: terms.policy,
        forced_sampler_count: None,
        refinement_steps: 1,
        frames_per_s: None,
        fallbacks: Vec::new(),
        forced_tile_count: None,
        viewpoints: Vec::new(),
        budget: terms.budget,
    })
}

/// How views are made where nobody names a method: with shared light where light is traced, and directly in plain light, which costs
/// less than sharing it. In plain light, budgets and policies that ask for samples begin with views from samples alone.
pub(crate) fn default_method(lighting: &str, Terms { policy, budget }: &Terms) -> String {
    let is_traced = lighting.parse().is_ok_and(|lighting: Lighting| lighting.is_traced());
    match policy {
        _ if is_traced => ReconstructionMethod::from(LightCacheQuality::default()).to_string(),
        _ if budget.budget.is_some() => ReconstructionMethod::default().to_string(),
        PolicyChoice::Pipeline | PolicyChoice::TimeShare => ReconstructionMethod::default().to_string(),
        PolicyChoice::Auto | PolicyChoice::Direct => DIRECT.to_owned(),
    }
}

/// How samples are taken where nobody names a method.
fn default_sampling(lighting: &str) -> SamplingMethod {
    lighting.parse().map_or_else(|_| SamplingMethod::default(), SamplingMethod::suited_to)
}

fn takes_light_from_samples(method: &str) -> bool {
    method.parse().is_ok_and(|method: ReconstructionMethod| method.light_cache_quality().is_some())
}

/// The same at a rate, with fallbacks under overload.
#[must_use]
pub fn at_rate(request: SessionRequest, frames_per_s: f64) -> SessionRequest {
    let fallbacks = fallbacks(&request.lighting, &request.method);
    SessionRequest { frames_per_s: Some(frames_per_s), fallbacks, ..request }
}

/// Fallbacks under overload, in order: no mirror images of the scene, fewer rays of light, a coarser method, smaller sample
/// images, fewer pictures a second. Each includes those before it. Steps that the lighting and the method do not have are skipped.
/// Shared light stays as it is, and the views' quality goes down step by step: other samples would have to be lit first.
fn fallbacks(lighting: &str, method: &str) -> Vec<Quality> {
    let mut fallbacks = Vec::new();
    let mut quality = Quality {
        lighting: lighting.to_owned(),
        method: method.to_owned(),
        sample_side_ratio: 1.0,
        frame_rate_ratio: 1.0,
    };
    let known: Option<ReconstructionMethod> = method.parse().ok();
    let mut coarser = std::iter::successors(known, |method| method.coarser()).skip(1);
    if takes_light_from_samples(method) {
        for coarser in coarser {
            quality.method = coarser.to_string();
            fallbacks.push(quality.clone());
        }
    } else {
        let whole: Option<Lighting> = lighting.parse().ok();
        // Views from depth images have glossy reflections beside a base alone, and no fallback has a base.
        let walks_cube = known.is_some_and(ReconstructionMethod::walks_cube);
        let reflecting = whole.filter(|lighting| lighting.reflections() > 0 || method == DIRECT || walks_cube);
        let unmirrored = reflecting.and_then(|lighting| lighting.without_reflections());
        let fewer_rays = unmirrored.or(whole).and_then(|lighting| lighting.with_fewer_rays());
        for lighting in unmirrored.into_iter().chain(fewer_rays) {
            quality.lighting = lighting.to_string();
            fallbacks.push(quality.clone());
        }
        if let Some(coarser) = coarser.next() {
            quality.method = coarser.to_string();
            fallbacks.push(quality.clone());
        }
        // The images of a cube have one size, and direct views have none.
        if !walks_cube && method != DIRECT {
            quality.sample_side_ratio = SAMPLE_SIDE_RATIO;
            fallbacks.push(quality.clone());
        }
    }
    fallbacks.push(Quality { frame_rate_ratio: FRAME_RATE_RATIO, ..quality });
    fallbacks
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

/// Requests of all views of all sets, numbered set by set, and view by view in each. They are made as they are drawn.
pub fn requests(sets: u32, views: Arc<[PinholeCamera]>) -> impl Iterator<Item = ViewRequest> + Send + 'static {
    (0..sets).flat_map(move |set_index| {
        let count = views.len();
        let views = views.clone();
        let first = u64::from(set_index) * count as u64;
        (0..count).map(move |at| ViewRequest { frame: first + at as u64, set_index, camera: views[at] })
    })
}

/// Asks for all views of all sets, as [`requests`] numbers them; `received` is given each as it comes, and is waited for.
/// Gives the seconds from the request to the last frame, decoded and checksummed.
///
/// # Errors
/// The cluster fails, frames are missing, or `received` fails.
pub async fn receive(
    session: &Session,
    views: &[PinholeCamera],
    received: impl AsyncFnMut(Frame) -> anyhow::Result<()>,
) -> anyhow::Result<f64> {
    let sets = session.plan().assignment.workload.timeline.set_count;
    receive_requests(session, requests(sets, views.into()), received).await
}

/// The same for any requests.
///
/// # Errors
/// As [`receive`].
pub async fn receive_requests(
    session: &Session,
    requests: impl Iterator<Item = ViewRequest> + Send + 'static,
    mut received: impl AsyncFnMut(Frame) -> anyhow::Result<()>,
) -> anyhow::Result<f64> {
    let start = Instant::now();
    let mut incoming = session.render_views(requests)?;
    while let Some(frame) = incoming.next().await {
        received(frame?).await?;
    }
    Ok(start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_with_mirror_images_lose_them_first() {
        let offered = OfferSettings { lighting: Some("shadows, reflections 2".to_owned()), ..OfferSettings::default() };
        let view = PinholeCamera::looking_at(glam::Vec3::Z, glam::Vec3::ZERO, glam::Vec3::Y, 0.8, glam::UVec2::ONE);
        let of_images = OfferSettings { method: Some("joint_carve".to_owned()), ..offered.clone() };
        assert!(request(of_images, PolicyChoice::Auto, &[view]).expect("a request").follows_mirrors);
        assert!(
            !request(offered, PolicyChoice::Auto, &[view]).expect("a request").follows_mirrors,
            "the scene has them"
        );
        let lightings =
            |lighting| -> Vec<String> { fallbacks(lighting, DIRECT).into_iter().map(|q| q.lighting).collect() };
        assert_eq!(lightings("shadows, reflections 2"), ["shadows"; 2]);
        assert_eq!(lightings("soft 8, reflections 1"), ["soft 8", "soft 2", "soft 2"]);
    }

    #[test]
    fn the_default_method_follows_from_the_light_the_policy_and_the_budget() {
        let budget = BudgetRequest { budget: Some("flip 0.05".to_owned()), names_method: false };
        let method = |lighting: &str, terms: &Terms| default_method(lighting, terms);
        for policy in [PolicyChoice::Auto, PolicyChoice::Direct, PolicyChoice::Pipeline, PolicyChoice::TimeShare] {
            for lighting in ["shadows", "soft 4", "phong, occlusion 8"] {
                assert_eq!(method(lighting, &policy.into()), "light_cache");
                assert_eq!(method(lighting, &Terms { policy, budget: budget.clone() }), "light_cache");
            }
        }
        for lighting in ["unlit", "phong", "phong, reflections 2"] {
            assert_eq!(method(lighting, &PolicyChoice::Auto.into()), DIRECT);
            assert_eq!(method(lighting, &PolicyChoice::Direct.into()), DIRECT);
            assert_eq!(method(lighting, &PolicyChoice::Pipeline.into()), "joint_carve");
            assert_eq!(method(lighting, &PolicyChoice::TimeShare.into()), "joint_carve");
            assert_eq!(method(lighting, &Terms { budget: budget.clone(), ..Terms::default() }), "joint_carve");
        }
    }

    #[test]
    fn samples_are_taken_as_suits_the_sessions_light_unless_the_offer_names_how() {
        let view = PinholeCamera::looking_at(glam::Vec3::Z, glam::Vec3::ZERO, glam::Vec3::Y, 0.8, glam::UVec2::ONE);
        let sampling = |lighting: &str, named: Option<&str>| {
            let sampling = named.map(str::to_owned);
            let offered = OfferSettings { lighting: Some(lighting.to_owned()), sampling, method: None };
            request(offered, PolicyChoice::Auto, &[view]).expect("a request").sampling
        };
        assert_eq!(sampling("soft 16, indirect 64", None), "non_redundant:coverage");
        assert_eq!(sampling("soft 16, occlusion 16", None), "conventional");
        assert_eq!(sampling("soft 16, indirect 64", Some("conventional")), "conventional");
    }

    #[test]
    fn shared_light_loses_quality_step_by_step_and_then_pictures() {
        let ladder = fallbacks("soft 16, occlusion 8", "light_cache:fine");
        let steps: Vec<_> = ladder.iter().map(|q| (q.method.as_str(), q.frame_rate_ratio)).collect();
        assert_eq!(
            steps,
            [("light_cache", 1.0), ("light_cache:fast", 1.0), ("light_cache:draft", 1.0), ("light_cache:draft", 0.8)]
        );
        assert!(ladder.iter().all(|q| q.lighting == "soft 16, occlusion 8" && q.sample_side_ratio == 1.0));
    }

    #[test]
    fn light_is_reduced_first_and_the_frame_rate_last() {
        let ladder = fallbacks("soft 16, occlusion 8", "light_field_search:100");
        let steps: Vec<_> = ladder
            .iter()
            .map(|q| (q.lighting.as_str(), q.method.as_str(), q.sample_side_ratio, q.frame_rate_ratio))
            .collect();
        let dim = "soft 4, occlusion 2";
        let coarse = "light_field_search:50";
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
    fn views_of_a_million_moments_are_numbered_as_they_are_drawn() {
        let up = glam::Vec3::Y;
        let camera =
            |x: f32| PinholeCamera::looking_at(glam::Vec3::new(x, 0.0, 3.0), glam::Vec3::ZERO, up, 1.0, [8, 8].into());
        let views: Arc<[PinholeCamera]> = [0.0, 1.0, 2.0].map(camera).into();
        let mut drawn = requests(1_000_000, views.clone()).skip(2_999_998);
        let last = |set_index, frame, at: usize| Some(ViewRequest { frame, set_index, camera: views[at] });
        assert_eq!([drawn.next(), drawn.next()], [last(999_999, 2_999_998, 1), last(999_999, 2_999_999, 2)]);
        assert_eq!(drawn.next(), None);
    }

    #[test]
    fn steps_without_a_coarser_setting_are_skipped() {
        assert_eq!(fallbacks("phong", "mesh").len(), 2);
        assert_eq!(fallbacks("phong", "joint_carve").len(), 3);
        assert_eq!(fallbacks("of the future", "of the future").len(), 2);
    }
}
