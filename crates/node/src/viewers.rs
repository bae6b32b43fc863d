//! The places of live viewers, which view cells follow.

use std::collections::{BTreeMap, BTreeSet};

use depth_image::PinholeCamera;

/// Viewpoints of one report.
const MAX_REPORTED: usize = 64;
/// The distance within which viewpoints are merged first, where there are too many.
const LEAST_APART: f32 = 1e-3;

/// The newest pose of each open stream.
#[derive(Debug, Default)]
pub(crate) struct Viewers {
    streams: BTreeMap<u64, (u64, PinholeCamera)>,
    /// Workloads whose viewers have moved, come or gone since the last report.
    changed: BTreeSet<u64>,
}

impl Viewers {
    pub(crate) fn moved(&mut self, stream: u64, workload_number: u64, camera: PinholeCamera) {
        let before = self.streams.insert(stream, (workload_number, camera));
        if before != Some((workload_number, camera)) {
            self.changed.extend(before.map(|(number, _)| number));
            self.changed.insert(workload_number);
        }
    }

    pub(crate) fn left(&mut self, stream: u64) {
        self.changed.extend(self.streams.remove(&stream).map(|(number, _)| number));
    }

    /// The workloads whose viewers have changed since the last call.
    pub(crate) fn take_changed(&mut self) -> BTreeSet<u64> {
        std::mem::take(&mut self.changed)
    }

    /// The viewpoints of a workload; the nearest are merged where there are too many.
    pub(crate) fn of(&self, workload_number: u64) -> Vec<PinholeCamera> {
        let cameras = self.streams.values().filter(|(number, _)| *number == workload_number).map(|(_, camera)| *camera);
        let cameras: Vec<_> = cameras.collect();
        let mut apart = 0.0;
        loop {
            // The first cameras that are farther from each other than `apart`, until there are too many.
            let mut kept = Vec::<PinholeCamera>::new();
            for camera in &cameras {
                if kept.len() <= MAX_REPORTED && kept.iter().all(|other| distance(other, camera) > apart) {
                    kept.push(*camera);
                }
            }
            if kept.len() <= MAX_REPORTED {
                return kept;
            }
            apart = (2.0 * apart).max(LEAST_APART);
        }
    }
}

/// Metres between eyes, and the difference of directions.
fn distance(a: &PinholeCamera, b: &PinholeCamera) -> f32 {
    a.eye_in_world.distance(b.eye_in_world) + a.forward_in_world().distance(b.forward_in_world())
}

#[cfg(test)]
mod tests {
    use glam::{UVec2, Vec3};

    use super::*;

    fn at(x_m: f32) -> PinholeCamera {
        let eye = Vec3::new(x_m, 0.0, 5.0);
        PinholeCamera::looking_at(eye, eye - Vec3::Z, Vec3::Y, 1.0, UVec2::splat(8))
    }

    #[test]
    fn viewers_are_reported_when_they_move_or_leave() {
        let mut viewers = Viewers::default();
        viewers.moved(5, 1, at(0.0));
        viewers.moved(6, 2, at(1.0));
        assert_eq!(viewers.take_changed(), [1, 2].into());
        viewers.moved(5, 1, at(0.0));
        assert_eq!(viewers.take_changed(), [].into(), "it rests");
        viewers.left(6);
        viewers.left(7);
        assert_eq!(viewers.take_changed(), [2].into());
        assert_eq!((viewers.of(1), viewers.of(2)), (vec![at(0.0)], vec![]));
    }

    #[test]
    fn many_viewpoints_are_merged_to_those_that_are_far_apart() {
        let mut viewers = Viewers::default();
        (0..1000).for_each(|stream| viewers.moved(stream, 1, at(stream as f32)));
        let few = viewers.of(1);
        assert!(few.len() > 25 && few.len() <= MAX_REPORTED, "{}", few.len());
        let farthest = |x_m: f32| few.iter().map(|camera| (camera.eye_in_world.x - x_m).abs()).fold(f32::MAX, f32::min);
        assert!((0..1000).all(|x_m| farthest(x_m as f32) <= 40.0), "each has one near it");
        let mut equal = Viewers::default();
        (0..200).for_each(|stream| equal.moved(stream, 1, at(3.0)));
        assert_eq!(equal.of(1), [at(3.0)]);
        let mut far = Viewers::default();
        (0..100u64).for_each(|stream| far.moved(stream, 1, at(f32::MAX * (stream % 3) as f32 * 0.5 - f32::MAX * 0.5)));
        assert!(!far.of(1).is_empty());
    }
}
