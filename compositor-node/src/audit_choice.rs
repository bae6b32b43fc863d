//! The choice of views to audit: at random, and as often as the share of audits allows.
//!
//! After an audit comes a random pause, whose mean gives audits their share of the time. The next audit is of a view that is
//! made after it. The choice does not depend on what views show. One stream fills one audit in four at most while others
//! move, and what was audited is not audited again.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use cluster::{SetContent, is_one_place};
use depth_image::PinholeCamera;
use node::push_latest;

/// Streams that were audited last, which wait for others.
const RECENT_STREAMS: usize = 3;
/// A stream that has made no view for so long is not waited for.
const WAITED_FOR: Duration = Duration::from_secs(5);
/// Audited views that are remembered.
const MAX_AUDITED: usize = 256;
/// Kinds of views that are remembered.
const MAX_KINDS: usize = 16;
/// The pause after the first audit of a kind, which may have built shaders.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
/// The least pause after a failure.
const FAILED_PAUSE: Duration = Duration::from_secs(10);

/// A view that could be audited.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) stream: u64,
    /// A random number that depends on the plan, the stream and the number of the view.
    pub(crate) random: u64,
    pub(crate) set: SetContent,
    pub(crate) camera: PinholeCamera,
}

/// The views of one workload by one method.
pub(crate) type Kind = (u64, String);

/// The end of an audit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ended {
    pub(crate) kind: Kind,
    /// The time without waits; `None` for a failure.
    pub(crate) busy_s: Option<f64>,
    /// The time with waits.
    pub(crate) wall_s: f64,
    /// A random number for the pause that follows.
    pub(crate) random: u64,
}

/// The audits of one compositor so far, as far as they matter to the next.
#[derive(Debug, Default)]
pub(crate) struct AuditChoice {
    is_auditing: bool,
    due: Option<Instant>,
    /// The streams of the last audits, the newest last.
    recent: VecDeque<u64>,
    /// When another stream made a view that could be audited.
    other_at: Option<Instant>,
    audited: VecDeque<(Kind, SetContent, PinholeCamera)>,
    /// Kinds of views whose first audit has been made.
    kinds: VecDeque<Kind>,
}

impl AuditChoice {
    /// The place of the view to audit now, if any. The audit is then under way until [`AuditChoice::end`].
    pub(crate) fn choose(
        &mut self,
        now: Instant,
        kind: &Kind,
        views: &[Candidate],
        least_apart_m: f32,
    ) -> Option<usize> {
        let seen = self.audited.iter().filter(|(of, ..)| of == kind);
        let mut new: Vec<usize> = (0..views.len()).collect();
        new.retain(|&at| !seen.clone().any(|(_, set, camera)| is_near(set, camera, &views[at], least_apart_m)));
        let mut eligible = new.clone();
        eligible.retain(|&place| !self.recent.contains(&views[place].stream));
        if !eligible.is_empty() {
            self.other_at = Some(now);
        }
        let waits_for_others = self.other_at.is_some_and(|at| now.saturating_duration_since(at) < WAITED_FOR);
        if eligible.is_empty() && !waits_for_others {
            eligible = new;
        }
        if self.is_auditing || self.due.is_some_and(|due| now < due) {
            return None;
        }
        let chosen = eligible.into_iter().min_by_key(|&place| views[place].random)?;
        let Candidate { stream, set, camera, .. } = views[chosen];
        (self.is_auditing, self.other_at) = (true, None);
        push_latest(&mut self.recent, stream, RECENT_STREAMS);
        push_latest(&mut self.audited, (kind.clone(), set, camera), MAX_AUDITED);
        Some(chosen)
    }

    /// The audit has ended. Audits may take `share` of the time.
    pub(crate) fn end(&mut self, now: Instant, ended: Ended, share: f64) {
        let Ended { kind, busy_s, wall_s, random } = ended;
        self.is_auditing = false;
        // A viewer who stays where an audit has failed is audited there once more.
        if busy_s.is_none() {
            self.audited.pop_back();
        }
        let is_first = !self.kinds.contains(&kind);
        let pause = match busy_s {
            None => random_pause(wall_s, share, random).max(FAILED_PAUSE),
            Some(_) if is_first => FIRST_PAUSE,
            Some(busy_s) => random_pause(busy_s, share, random),
        };
        if is_first && busy_s.is_some() {
            push_latest(&mut self.kinds, kind, MAX_KINDS);
        }
        self.due = Some(now + pause);
    }
}

/// A pause after work of `busy_s` that takes `share` of the time in the mean. It is exponential: an even one could keep step
/// with a path that repeats.
fn random_pause(busy_s: f64, share: f64, random: u64) -> Duration {
    // Above 0 and at most 1.
    let unit = ((random >> 11) + 1) as f64 / (1_u64 << 53) as f64;
    Duration::try_from_secs_f64(busy_s * (share.recip() - 1.0) * -unit.ln()).unwrap_or(FAILED_PAUSE)
}

/// Whether a view was audited from the same set and about the same place.
fn is_near(set: &SetContent, camera: &PinholeCamera, view: &Candidate, least_apart_m: f32) -> bool {
    *set == view.set
        && is_one_place(camera, &view.camera, least_apart_m)
        && camera.size_px == view.camera.size_px
        && camera.focal_px == view.camera.focal_px
}

#[cfg(test)]
mod tests {
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::test_support::set_content;

    fn view(stream: u64, x_m: f32, random: u64) -> Candidate {
        let eye = Vec3::new(x_m, 0.0, 5.0);
        let camera = PinholeCamera::looking_at(eye, eye - Vec3::Z, Vec3::Y, 1.0, UVec2::splat(8));
        Candidate { stream, random, set: set_content(0), camera }
    }

    fn kind() -> Kind {
        (1, "mesh".to_owned())
    }

    fn ended(busy_s: Option<f64>, random: u64) -> Ended {
        Ended { kind: kind(), busy_s, wall_s: 0.0, random }
    }

    /// Audits `views` at a time, one after the other without pauses: the streams that were chosen.
    fn streams_of(rounds: usize, views: impl Fn(usize) -> Vec<Candidate>) -> Vec<u64> {
        let mut choice = AuditChoice::default();
        let start = Instant::now();
        let mut streams = Vec::new();
        for round in 0..rounds {
            let now = start + Duration::from_secs(2 * round as u64);
            let views = views(round);
            if let Some(chosen) = choice.choose(now, &kind(), &views, 1e-3) {
                streams.push(views[chosen].stream);
                choice.end(now, ended(Some(0.0), 1), 0.01);
            }
        }
        streams
    }

    #[test]
    fn the_least_random_number_of_a_batch_is_chosen_once() {
        let mut choice = AuditChoice::default();
        let now = Instant::now();
        let views = [view(1, 0.0, 9), view(1, 1.0, 3), view(1, 2.0, 5)];
        assert_eq!(choice.choose(now, &kind(), &views, 1e-3), Some(1));
        assert_eq!(choice.choose(now, &kind(), &views, 1e-3), None, "one at a time");
        choice.end(now, ended(Some(0.02), u64::MAX / 3), 0.01);
        let later = now + FIRST_PAUSE;
        assert_eq!(choice.choose(now, &kind(), &views, 1e-3), None, "not due");
        assert_eq!(choice.choose(later, &kind(), &views, 1e-3), Some(2), "the place of the first was audited");
        let other_set = [Candidate { set: set_content(1), ..view(1, 1.0, 3) }];
        choice.end(later, ended(None, 0), 0.01);
        let at = later + FAILED_PAUSE;
        assert_eq!(choice.choose(at, &kind(), &other_set, 1e-3), Some(0));
        choice.end(at, ended(None, 0), 0.01);
        let other_method = (1, "splat".to_owned());
        assert_eq!(choice.choose(at + FAILED_PAUSE, &other_method, &other_set, 1e-3), Some(0), "other views");
    }

    #[test]
    fn a_place_is_audited_again_if_its_audit_has_failed() {
        let mut choice = AuditChoice::default();
        let mut now = Instant::now();
        let views = [view(1, 0.0, 1)];
        for busy_s in [None, None, Some(0.01)] {
            assert_eq!(choice.choose(now, &kind(), &views, 1e-3), Some(0), "{busy_s:?}");
            choice.end(now, ended(busy_s, 0), 0.5);
            now += FAILED_PAUSE + FIRST_PAUSE;
        }
        assert_eq!(choice.choose(now, &kind(), &views, 1e-3), None, "it has been audited");
    }

    #[test]
    fn a_stream_fills_one_audit_in_four_while_others_move() {
        // Stream 0 makes ten times the views of each of the others.
        let views = |round: usize| {
            let place = round as f32;
            let mut views: Vec<Candidate> = (0..10).map(|n| view(0, place + 0.01 * n as f32, n)).collect();
            views.extend((1..5).map(|stream| view(stream, place + 0.5, 100 + stream)));
            views
        };
        let streams = streams_of(100, views);
        assert_eq!(streams.len(), 100);
        assert!(streams.iter().filter(|&&stream| stream == 0).count() <= 26, "{streams:?}");
        assert_eq!(streams_of(40, |round| vec![view(7, round as f32, 1)]), [7; 40], "alone, it has all");
        // The other has left.
        let streams = streams_of(40, |round| match round {
            0 => vec![view(1, 0.0, 1), view(2, 0.0, 2)],
            _ => vec![view(1, round as f32, 1)],
        });
        assert!(streams.len() >= 37, "{streams:?}");
    }

    #[test]
    fn a_viewer_that_stays_is_audited_once() {
        assert_eq!(streams_of(50, |_| vec![view(1, 0.0, 1)]), [1]);
    }

    #[test]
    fn audits_take_their_share_of_the_time_in_the_mean() {
        let busy_s = 0.03;
        let share = 0.01;
        let number = |place: u64| place.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let pauses_s = (0..10_000).map(|place| random_pause(busy_s, share, number(place)).as_secs_f64());
        let mean_s = pauses_s.sum::<f64>() / 10_000.0;
        assert!((busy_s / (busy_s + mean_s) / share - 1.0).abs() < 0.02, "{mean_s}");
        assert!(random_pause(1.0, 0.01, 0) < Duration::from_secs(4_000) && random_pause(1.0, 0.5, u64::MAX).is_zero());
    }
}
