//! Hysteresis between the moments of a moving scene: what an image keeps would flicker where a test is near its limit.
//!
//! A set is compared with what it held at one moment before it, the same for several sets, and not with the set before
//! it: so what a set holds follows from its own time and that one, whichever node samples it and in whatever order.

use std::sync::{Mutex, PoisonError};

use depth_image::Camera;
use render::{DrawWork, LeaveOut, RenderError, Renderer, Settled};

use crate::{SampleWork, SamplingMethod};

/// The last moment that was settled at: it serves the sets after it.
#[derive(Default)]
pub(crate) struct Settling(Mutex<Option<(Moment, Settled)>>);

#[derive(PartialEq)]
struct Moment {
    scene: u64,
    time_s: f32,
    cameras: Vec<Camera>,
    method: SamplingMethod,
}

impl Settling {
    /// What the set held at the moment that it settled at, if it does.
    pub fn before(
        &self,
        renderer: &Renderer,
        work: &SampleWork<'_>,
        leave_out: LeaveOut,
    ) -> Result<Option<Settled>, RenderError> {
        let moves = |&time_s: &f32| work.method.settles() && time_s != work.draw.scene_time_s;
        let Some(time_s) = work.temporal_reference_s.filter(moves) else { return Ok(None) };
        let (scene, cameras) = (work.draw.scene.identity(), work.cameras.to_vec());
        let moment = Moment { scene, time_s, cameras, method: work.method };
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, settled)) = last.as_ref().filter(|(other, _)| *other == moment) {
            return Ok(Some(settled.clone()));
        }
        let draw = DrawWork { scene_time_s: time_s, ..work.draw };
        let (_, settled) = last.insert((moment, renderer.settle(draw, work.cameras, leave_out)?));
        Ok(Some(settled.clone()))
    }
}
