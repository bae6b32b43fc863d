//! A view of a workload that depends on no viewer.

use depth_image::{Aabb, PinholeCamera};
use glam::{UVec2, Vec3};

/// The view of a box from outside, slantwise from above.
pub(crate) fn view_from_outside(volume: &Aabb, size_px: UVec2) -> PinholeCamera {
    let middle = volume.center();
    let size_m = volume.size().length();
    let eye = middle + size_m * Vec3::new(0.9, 0.7, 0.9);
    PinholeCamera::looking_at(eye, middle, Vec3::Y, 0.8, size_px)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_box_is_in_view() {
        for max in [Vec3::splat(2.0), Vec3::new(40.0, 1.0, 3.0), Vec3::new(1.0, 90.0, 1.0)] {
            let volume = Aabb { min: -Vec3::ONE, max };
            let view = view_from_outside(&volume, UVec2::splat(64));
            let is_seen = |corner| view.project(corner).is_some_and(|at| view.contains(at.pixel));
            assert!(view.validate().is_ok() && volume.corners().into_iter().all(is_seen), "{max}");
        }
    }
}
