//! Hysteresis between the moments of a moving scene: the samples of an image would flicker where a test is near its limit.
//!
//! A set is compared with the same set at one moment before it, the same for several sets, and not with the set before
//! it: so the samples of a set follow from its own time and that one, whichever node takes them and in whatever order.

use depth_image::Camera;
use parking_lot::Mutex;
use render::{DrawWork, RedundancyTest, RenderError, Renderer, TemporalReference};

use crate::{methods::SamplingMethod, work::SampleWork};

/// The last temporal reference: it serves the sets after it.
#[derive(Default)]
pub(crate) struct TemporalHysteresis(Mutex<Option<(Moment, TemporalReference)>>);

#[derive(PartialEq)]
struct Moment {
    scene: u64,
    time_s: f32,
    cameras: Vec<Camera>,
    method: SamplingMethod,
}

impl TemporalHysteresis {
    /// The samples of the set at its reference time, if the method has hysteresis.
    pub fn reference(
        &self,
        renderer: &Renderer,
        work: &SampleWork<'_>,
        test: RedundancyTest,
    ) -> Result<Option<TemporalReference>, RenderError> {
        let Some(time_s) = work.temporal_reference_s else { return Ok(None) };
        if !work.method.has_hysteresis() || time_s == work.draw.scene_time_s {
            return Ok(None);
        }
        let scene = work.draw.scene.identity;
        let cameras = work.cameras.to_vec();
        let moment = Moment { scene, time_s, cameras, method: work.method };
        let mut last = self.0.lock();
        if let Some((_, reference)) = last.as_ref().filter(|(other, _)| *other == moment) {
            return Ok(Some(reference.clone()));
        }
        let draw = DrawWork { scene_time_s: time_s, ..work.draw };
        let (_, reference) = last.insert((moment, renderer.temporal_reference(draw, work.cameras, test)?));
        Ok(Some(reference.clone()))
    }
}
