//! Content hashes of sample sets.

use depth_image::{Aabb, Camera, Illumination};
use glam::Vec3;
use serde::Serialize;

use crate::workload::Workload;

/// The name of a sample set's content, of one view cell. It is equal for equal scene, time, cameras, sampling, lighting,
/// step of refinement, lights and volume, under any plan. Sets of equal content are not sampled again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SetContent([u8; 32]);

/// Everything that the content of a set depends on.
#[derive(Serialize)]
struct Shown<'a> {
    scene: &'a str,
    time_s: f32,
    temporal_reference_s: f32,
    sampling: &'a str,
    lighting: &'a str,
    /// It decides which planes images have.
    method: &'a str,
    volume: Aabb,
    background_linear: Vec3,
    refinement: [u32; 2],
    illumination: &'a Illumination,
    sample_cameras: &'a [Camera],
}

impl SetContent {
    /// The content of a set; `None` beyond the timeline.
    pub(crate) fn of(workload: &Workload, set_index: u32) -> Option<Self> {
        let time_s = workload.timeline.time_s(set_index)?;
        let refinement = workload.refinement(set_index);
        let shown = Shown {
            scene: workload.scene.hash.as_str(),
            time_s,
            temporal_reference_s: workload.timeline.temporal_reference_s(set_index).unwrap_or(time_s),
            sampling: &workload.sampling,
            lighting: &workload.lighting,
            method: &workload.method,
            volume: workload.volume,
            background_linear: workload.background_linear,
            refinement: [refinement.step, refinement.steps],
            illumination: &workload.illumination,
            sample_cameras: &workload.sample_cameras,
        };
        // Postcard prefixes lengths, so that no two sets have the same bytes. Writing to a hasher does not fail.
        let hash = postcard::to_io(&shown, blake3::Hasher::new()).ok()?;
        Some(Self(hash.finalize().into()))
    }
}
