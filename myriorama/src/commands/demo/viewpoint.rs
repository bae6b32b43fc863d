//! The viewpoint of the first page, and sample cameras around it.

use anyhow::Context as _;
use app_core::setup::Setup;
use depth_image::{PinholeCamera, ViewCell};
use glam::{UVec2, Vec2, Vec3};
use sampling::Rig;
use scene::SceneSpec;

/// Half the distance between neighbouring sample cameras, over the distance to the target.
const SPREAD: f32 = 0.015;
/// The field of view of sample cameras over the view's: they stand beside it, and its border is to be in their images.
const WIDER: f32 = 1.1;

/// A place to look from: the middle of a rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Viewpoint(Rig);

impl Viewpoint {
    /// The meadow's own, or the middle of the places between a scene's sample cameras.
    pub(super) fn of(spec: &SceneSpec, setup: &Setup) -> anyhow::Result<Self> {
        if matches!(spec, SceneSpec::TreeTerrain { .. }) {
            return Ok(Self::meadow());
        }
        let cell = ViewCell::between(&setup.around).context("no sample cameras")?;
        let middle = cell.camera_at(Vec2::ZERO, UVec2::ONE);
        let distance_m = middle.eye_in_world.distance(setup.offer.volume.center());
        let target_in_world = middle.eye_in_world + middle.forward_in_world() * distance_m;
        let fov_y_rad = 2.0 * (0.5 / middle.focal_px.y).atan();
        Ok(Self::new(middle.eye_in_world, target_in_world, fov_y_rad, middle.near_m))
    }

    /// Over the meadow towards the tree, steep enough that the meadow's border is nowhere in the picture.
    fn meadow() -> Self {
        Self::new(Vec3::new(0.0, 1.4, 1.1), Vec3::new(0.0, 0.2, 0.03), 0.465, 0.02)
    }

    fn new(eye_in_world: Vec3, target_in_world: Vec3, fov_y_rad: f32, near_m: f32) -> Self {
        let offset = eye_in_world - target_in_world;
        let right = Vec3::Y.cross(offset).normalize_or(Vec3::X);
        let half_m = offset.length() * SPREAD;
        let half_edges_in_world = [right * half_m, offset.cross(right).normalize_or(Vec3::Y) * half_m];
        Self(Rig { center_in_world: eye_in_world, half_edges_in_world, target_in_world, fov_y_rad, near_m })
    }

    /// The view from the place.
    pub(super) fn camera(&self, size_px: UVec2) -> PinholeCamera {
        self.0.camera_at(Vec2::ZERO, size_px)
    }

    /// Four sample cameras around it.
    pub(super) fn samples(&self, size_px: UVec2) -> Vec<PinholeCamera> {
        Rig { fov_y_rad: self.0.fov_y_rad * WIDER, ..self.0 }.samples(size_px)
    }
}

#[cfg(test)]
mod tests {
    use app_core::setup::SceneArgs;
    use depth_image::PixelDepth;

    use super::*;

    const SIZE_PX: UVec2 = UVec2::new(628, 392);

    #[test]
    fn no_corner_of_the_meadows_picture_leaves_the_meadow() {
        let camera = Viewpoint::meadow().camera(SIZE_PX);
        for corner in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE] {
            let at =
                |planar_depth_m| camera.unproject(PixelDepth { pixel: corner * SIZE_PX.as_vec2(), planar_depth_m });
            let near = at(0.5);
            let far = at(1.0);
            // The ray falls to the least height that the ground has.
            let ground = near + (far - near) * (near.y / (near.y - far.y));
            assert!(near.y > far.y && ground.x.abs() < 1.0 && ground.z.abs() < 1.0, "{ground}");
        }
    }

    #[test]
    fn sample_cameras_surround_the_view_and_see_its_border() {
        let spec: SceneSpec = "courtyard".parse().unwrap();
        let setup = SceneArgs::new(spec.clone()).load().unwrap();
        for viewpoint in [Viewpoint::meadow(), Viewpoint::of(&spec, &setup).unwrap()] {
            let view = viewpoint.camera(SIZE_PX);
            let samples = viewpoint.samples(SIZE_PX * 2);
            let middle = samples.iter().map(|camera| camera.eye_in_world).sum::<Vec3>() / 4.0;
            assert!(middle.distance(view.eye_in_world) < 1e-4 * (1.0 + middle.length()), "{viewpoint:?}");
            let planar_depth_m = viewpoint.0.center_in_world.distance(viewpoint.0.target_in_world);
            for corner in [Vec2::ZERO, Vec2::ONE] {
                let point = view.unproject(PixelDepth { pixel: corner * SIZE_PX.as_vec2(), planar_depth_m });
                for camera in &samples {
                    assert!(camera.project(point).is_some_and(|at| camera.contains(at.pixel)), "{viewpoint:?}");
                }
            }
        }
    }
}
