//! The course of a viewer: where it will be soon, from where it has been.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use depth_image::PinholeCamera;
use glam::Vec3;
use node::push_latest;

/// Poses that a course remembers.
const MAX_POSES: usize = 16;
/// The time that a course looks back, and ahead.
const HORIZON: Duration = Duration::from_secs(1);
/// Poses that are closer in time tell no speed.
const LEAST_SPAN: Duration = Duration::from_millis(20);

/// The last places of a viewer.
#[derive(Debug, Default)]
pub(crate) struct Course(VecDeque<(Instant, Vec3)>);

impl Course {
    /// Adds a pose that arrived at `at`.
    pub(crate) fn add(&mut self, at: Instant, camera: &PinholeCamera) {
        push_latest(&mut self.0, (at, camera.eye_in_world), MAX_POSES);
        while self.0.front().is_some_and(|(first, _)| at.saturating_duration_since(*first) > HORIZON) {
            self.0.pop_front();
        }
    }

    /// The last camera where it will be in a second, if it goes on straight ahead; `None` where it rests or is new.
    pub(crate) fn in_a_second(&self, camera: &PinholeCamera) -> Option<PinholeCamera> {
        let ((first, from), (last, to)) = (self.0.front()?, self.0.back()?);
        let span = last.saturating_duration_since(*first);
        let eye_in_world = *to + (*to - *from) * (HORIZON.as_secs_f32() / span.as_secs_f32());
        let is_usable = span >= LEAST_SPAN && to != from && eye_in_world.is_finite();
        is_usable.then_some(PinholeCamera { eye_in_world, ..*camera })
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    fn at(x_m: f32) -> PinholeCamera {
        PinholeCamera::looking_at(Vec3::new(x_m, 0.0, 5.0), Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8))
    }

    #[test]
    fn a_viewer_that_walks_is_a_second_of_its_speed_further() {
        let start = Instant::now();
        let mut course = Course::default();
        for step in 0..40u32 {
            course.add(start + step * Duration::from_millis(100), &at(0.2 * step as f32));
            let ahead = course.in_a_second(&at(0.2 * step as f32));
            let eye = ahead.map(|camera| camera.eye_in_world.x);
            assert!(if step == 0 { eye.is_none() } else { (eye.unwrap() - 0.2 * step as f32 - 2.0).abs() < 1e-3 });
        }
        // It stops: after a second without a movement it rests.
        for step in 40..52u32 {
            course.add(start + step * Duration::from_millis(100), &at(7.8));
        }
        assert_eq!(course.in_a_second(&at(7.8)), None);
    }

    #[test]
    fn poses_without_a_time_between_them_tell_no_speed() {
        let start = Instant::now();
        let mut course = Course::default();
        course.add(start, &at(0.0));
        course.add(start, &at(1e30));
        assert_eq!(course.in_a_second(&at(1e30)), None);
    }
}
