//! The times of views on this node, learnt from calls: what one more view of any size would take.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use depth_image::Antialias;
use glam::UVec2;
use node::push_latest;
use parking_lot::Mutex;
use tonic::Status;

/// Calls of one kind that are remembered; the quickest counts, for the others may have built shaders.
const REMEMBERED: usize = 4;
/// Calls of a kind before it is known: the first builds shaders.
const LEAST_CALLS: usize = 2;
/// A smaller call takes as long as this many pixels at least.
const LEAST_PIXELS: usize = 1 << 16;
/// A kind that was not made for so long is tried again, though its views took too long.
const TRIED_AGAIN_AFTER: Duration = Duration::from_secs(60);
/// Kinds that are remembered.
const MAX_KINDS: usize = 256;

/// Views of one kind take a time in proportion to their pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ViewKind {
    pub(crate) workload_number: u64,
    /// The reconstruction method, or [`cluster::DIRECT`] for views that are drawn from the scene.
    pub(crate) method: String,
    pub(crate) antialias: Antialias,
}

/// What is known of a kind.
struct Times {
    kind: ViewKind,
    /// The seconds a pixel of its last calls.
    pixel_s: VecDeque<f64>,
    learned_at: Instant,
}

/// The times of this node's views.
pub(crate) struct ViewTimes {
    /// A view that takes longer is refused.
    max_view_s: f64,
    /// The kind that was made last is the last.
    kinds: Mutex<VecDeque<Times>>,
}

impl ViewTimes {
    pub(crate) fn new(max_view_s: f64) -> Self {
        Self { max_view_s, kinds: Mutex::default() }
    }

    /// Learns from a call of `pixels` that took `seconds`.
    pub(crate) fn learn(&self, now: Instant, kind: &ViewKind, pixels: usize, seconds: f64) {
        let mut kinds = self.kinds.lock();
        let known = kinds.iter().position(|times| times.kind == *kind).and_then(|place| kinds.remove(place));
        let mut pixel_s = known.map(|times| times.pixel_s).unwrap_or_default();
        push_latest(&mut pixel_s, seconds / pixels.max(LEAST_PIXELS) as f64, REMEMBERED);
        push_latest(&mut kinds, Times { kind: kind.clone(), pixel_s, learned_at: now }, MAX_KINDS);
    }

    /// The seconds of one view; `None` for a kind that is not known yet.
    pub(crate) fn predicted_s(&self, kind: &ViewKind, size_px: UVec2) -> Option<f64> {
        Some(self.known(kind, size_px)?.0)
    }

    /// Checks that a view does not take too long. A view of a kind that is not known yet is admitted.
    pub(crate) fn check(&self, now: Instant, kind: &ViewKind, size_px: UVec2) -> Result<(), Status> {
        let most_s = self.max_view_s;
        let Some((seconds, learned_at)) = self.known(kind, size_px) else { return Ok(()) };
        if seconds <= most_s || now.saturating_duration_since(learned_at) >= TRIED_AGAIN_AFTER {
            return Ok(());
        }
        Err(Status::resource_exhausted(format!(
            "max-view-s: a view of {}x{} by {} is predicted to take {seconds:.1} s here, and {most_s} s are allowed",
            size_px.x, size_px.y, kind.method
        )))
    }

    /// The seconds of one view, and when its kind was learned from.
    fn known(&self, kind: &ViewKind, size_px: UVec2) -> Option<(f64, Instant)> {
        let kinds = self.kinds.lock();
        let times = kinds.iter().find(|times| times.kind == *kind && times.pixel_s.len() >= LEAST_CALLS)?;
        let pixel_s = times.pixel_s.iter().copied().fold(f64::INFINITY, f64::min);
        Some((pixel_s * f64::from(size_px.x) * f64::from(size_px.y), times.learned_at))
    }
}

#[cfg(test)]
mod tests {
    use tonic::Code;

    use super::*;

    fn kind(workload_number: u64, method: &str) -> ViewKind {
        ViewKind { workload_number, method: method.to_owned(), antialias: Antialias::NONE }
    }

    #[test]
    fn times_grow_with_pixels_and_the_quickest_of_the_last_calls_counts() {
        let now = Instant::now();
        let times = ViewTimes::new(120.0);
        let slow = kind(1, "joint_carve");
        let size_px = UVec2::new(1024, 1024);
        times.learn(now, &slow, 1 << 16, 60.0);
        assert_eq!(times.predicted_s(&slow, size_px), None, "the first call builds shaders");
        times.learn(now, &slow, 1 << 16, 1.0);
        times.learn(now, &slow, 1 << 18, 8.0);
        assert_eq!(times.predicted_s(&slow, size_px), Some(16.0));
        (0..REMEMBERED).for_each(|_| times.learn(now, &slow, 1 << 20, 32.0));
        assert_eq!(times.predicted_s(&slow, size_px), Some(32.0), "it has become slower");
        for other in [kind(2, "joint_carve"), kind(1, "mesh")] {
            assert_eq!(times.predicted_s(&other, size_px), None);
        }
    }

    #[test]
    fn the_overhead_of_small_calls_predicts_no_long_views() {
        let now = Instant::now();
        let times = ViewTimes::new(120.0);
        (0..2).for_each(|_| times.learn(now, &kind(1, "mesh"), 16 * 16, 0.005));
        assert!(times.check(now, &kind(1, "mesh"), UVec2::new(7680, 4320)).is_ok());
    }

    #[test]
    fn a_view_that_takes_too_long_is_refused_by_name() {
        let now = Instant::now();
        let times = ViewTimes::new(120.0);
        let known = kind(1, "direct");
        let size_px = UVec2::new(3840, 2160);
        (0..2).for_each(|_| times.learn(now, &known, 1 << 16, 1.0));
        assert!(times.check(now, &kind(2, "direct"), size_px).is_ok(), "not known");
        assert!(times.check(now, &known, UVec2::new(1920, 1080)).is_ok());
        let refused = times.check(now, &known, size_px).unwrap_err();
        assert_eq!(refused.code(), Code::ResourceExhausted);
        let text = "max-view-s: a view of 3840x2160 by direct is predicted to take 126.6 s here, and 120 s are allowed";
        assert_eq!(refused.message(), text);
        let later = now + TRIED_AGAIN_AFTER;
        assert!(times.check(later, &known, size_px).is_ok(), "tried again");
        times.learn(later, &known, 1 << 16, 1.0);
        assert!(times.check(later, &known, size_px).is_err(), "and refused once more");
    }

    #[test]
    fn the_kinds_that_were_made_long_ago_are_forgotten() {
        let now = Instant::now();
        let times = ViewTimes::new(120.0);
        for _ in 0..2 {
            (0..2 * MAX_KINDS as u64).for_each(|number| times.learn(now, &kind(number, "mesh"), 1, 1.0));
        }
        assert_eq!(times.kinds.lock().len(), MAX_KINDS);
    }
}
