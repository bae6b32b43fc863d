//! The settings that pictures depend on, as a record names them.

use cluster::{OfferStatus, SceneHash, SessionRequest};
use depth_image::Exposure;
use serde_json::{Map, Value};

/// The settings of a request, each as text: numbers would be read back less exactly.
pub(super) fn of(request: &SessionRequest, offer: &OfferStatus) -> Map<String, Value> {
    let SessionRequest { timeline, typical_view, planes, viewpoints, .. } = request;
    // View cells follow from the views; their sample cameras are the coordinator's otherwise.
    let samples = if viewpoints.is_empty() { format!("{:?}", offer.sample_cameras) } else { format!("{viewpoints:?}") };
    let exposure = if request.auto_exposure { Exposure::Auto } else { Exposure::Ev(planes.tone.exposure) };
    let settings = [
        ("scene", offer.scene.hash.as_str().to_owned()),
        ("sample_cameras", SceneHash::of(samples.as_bytes()).as_str().to_owned()),
        ("sampling", request.sampling.clone()),
        ("lighting", request.lighting.clone()),
        ("method", request.method.clone()),
        ("budget", request.budget.budget.clone().unwrap_or_default()),
        ("policy", request.policy.to_string()),
        ("codec", request.codec.clone()),
        ("antialias", planes.antialias.to_string()),
        ("exposure", exposure.to_string()),
        ("tone_map", planes.tone.curve.to_string()),
        ("depth", planes.inverse_depth.to_string()),
        ("provenance", planes.provenance.to_string()),
        ("size", format!("{}x{}", typical_view.size_px.x, typical_view.size_px.y)),
        ("frames", timeline.set_count.to_string()),
        ("frame_step_s", timeline.step_s.to_string()),
        ("refinement_steps", request.refinement_steps.to_string()),
    ];
    settings.map(|(name, value)| (name.to_owned(), Value::String(value))).into_iter().collect()
}
