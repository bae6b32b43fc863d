//! Cameras and bounds.

use cluster::InvalidField;
use depth_image::{
    Aabb, Camera, LightDirections, LightFieldCamera, ParallelCamera, PinholeCamera, SampleCamera, SinglePoleCamera,
};
use glam::{Quat, UVec2, Vec2, Vec3};

use super::{Convert, required};
use crate::error::WireError;
use crate::proto;
use crate::proto::camera::Model;

messages! {
    Vec2 = Vec2 { x, y };
    ImageSize = UVec2 { ; x: width_px, y: height_px };
    Bounds = Aabb { ; min: min_in_world_m as "bounds.min_in_world_m", max: max_in_world_m as "bounds.max_in_world_m" },
        then |bounds| match bounds.is_empty() {
            true => Err(InvalidField::out_of_range("bounds", "empty", "min <= max on every axis")),
            false => Ok(()),
        };
    PinholeCamera = PinholeCamera {
        focal_px as "camera.focal_px", principal_px as "camera.principal_px", near_m;
        eye_in_world: eye_in_world_m as "camera.eye_in_world_m",
        world_from_camera: world_from_camera_unit as "camera.world_from_camera_unit", size_px: width_px | height_px
    }, valid or Camera;
    SinglePoleCamera = SinglePoleCamera {
        reference as "camera.single_pole.reference", pole_px as "camera.single_pole.pole_px", distortion_px, farthest_m
    }, valid or Camera, then |camera| match camera.reference.contains(camera.pole_px) {
        true => Ok(()),
        // Tiles, which do not hold the pole of their image, do not travel.
        false => Err(InvalidField::out_of_range("camera.single_pole.pole_px", camera.pole_px, "in the image")),
    };
    ParallelCamera = ParallelCamera {
        spacing_m, range_m; corner_in_world: corner_in_world_m as "camera.parallel.corner_in_world_m",
        world_from_camera: world_from_camera_unit as "camera.parallel.world_from_camera_unit",
        size_px: width_px | height_px
    }, valid or Camera;
    LightFieldCamera = LightFieldCamera {
        bounds as "camera.light_field.bounds", side_px;
        directions: direction_count as "camera.light_field", first_pair: first_pair_index, pairs: pair_count
    }, valid or Camera;
}

nested!(Vec3 = Vec3, Quaternion = Quat);

impl Convert<proto::Vec3> for Vec3 {
    fn read(v: proto::Vec3, field: &'static str) -> Result<Self, WireError> {
        let v = Self::new(v.x, v.y, v.z);
        if v.is_finite() { Ok(v) } else { Err(InvalidField::out_of_range(field, v, "finite").into()) }
    }

    fn write(self) -> proto::Vec3 {
        proto::Vec3 { x: self.x, y: self.y, z: self.z }
    }
}

impl Convert<proto::Quaternion> for Quat {
    fn read(q: proto::Quaternion, _: &'static str) -> Result<Self, WireError> {
        Ok(Self::from_xyzw(q.x, q.y, q.z, q.w))
    }

    fn write(self) -> proto::Quaternion {
        proto::Quaternion { x: self.x, y: self.y, z: self.z, w: self.w }
    }
}

impl Convert<proto::Camera> for Camera {
    fn read(camera: proto::Camera, _: &'static str) -> Result<Self, WireError> {
        match SampleCamera::read(camera, "camera")? {
            SampleCamera::Depth(camera) => Ok(camera),
            other @ (SampleCamera::Layered(_) | SampleCamera::LightField(_)) => {
                Err(InvalidField::out_of_range("camera.model", other.model_name(), "pinhole or single_pole").into())
            }
        }
    }

    fn write(self) -> proto::Camera {
        SampleCamera::Depth(self).write()
    }
}

impl Convert<proto::Camera> for SampleCamera {
    fn read(camera: proto::Camera, _: &'static str) -> Result<Self, WireError> {
        Ok(match required(camera.model, "camera.model")? {
            Model::Pinhole(camera) => Camera::Pinhole(PinholeCamera::read(camera, "camera.pinhole")?).into(),
            Model::SinglePole(camera) => {
                Camera::SinglePole(SinglePoleCamera::read(camera, "camera.single_pole")?).into()
            }
            Model::Parallel(camera) => ParallelCamera::read(camera, "camera.parallel")?.into(),
            Model::LightField(camera) => LightFieldCamera::read(camera, "camera.light_field")?.into(),
        })
    }

    fn write(self) -> proto::Camera {
        let model = match self {
            Self::Depth(Camera::Pinhole(camera)) => Model::Pinhole(camera.write()),
            Self::Depth(Camera::SinglePole(camera)) => Model::SinglePole(camera.write()),
            Self::Layered(camera) => Model::Parallel(camera.write()),
            Self::LightField(camera) => Model::LightField(camera.write()),
        };
        proto::Camera { model: Some(model) }
    }
}

impl Convert<u32> for LightDirections {
    fn read(count: u32, field: &'static str) -> Result<Self, WireError> {
        Ok(Self::of(count).map_err(|source| InvalidField::Camera { field, source })?)
    }

    fn write(self) -> u32 {
        self.count()
    }
}

#[cfg(test)]
mod tests {
    use depth_image::CubeGrid;

    use super::*;

    #[test]
    fn cameras_of_light_fields_survive_and_others_are_refused() {
        let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
        let camera = SampleCamera::from(LightFieldCamera::around(bounds, LightDirections::D258, 64));
        for camera in [camera, camera.tile(1, 4)] {
            assert_eq!(SampleCamera::read(camera.write(), "camera"), Ok(camera));
        }
        let own = camera.light_field().copied().expect("a light field").write();
        let refused = |camera: proto::LightFieldCamera| {
            LightFieldCamera::read(camera, "camera.light_field").expect_err("a fault").to_string()
        };
        assert!(refused(proto::LightFieldCamera { direction_count: 100, ..own }).contains("directions"));
        assert!(refused(proto::LightFieldCamera { side_px: 91, ..own }).contains("side_px"));
        assert!(refused(proto::LightFieldCamera { pair_count: u32::MAX, ..own }).contains("pairs"));
        assert!(refused(proto::LightFieldCamera { bounds: None, ..own }).contains("camera.light_field"));
    }

    fn camera() -> SinglePoleCamera {
        let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
        SinglePoleCamera::around(&bounds, Vec3::Z * 5.0, 20.0, UVec2::new(64, 48))
    }

    #[test]
    fn cameras_of_every_model_survive_the_round_trip() {
        for camera in [Camera::Pinhole(camera().reference), Camera::SinglePole(camera())] {
            assert_eq!(Camera::read(camera.write(), "camera"), Ok(camera));
        }
    }

    #[test]
    fn parallel_cameras_travel_as_sample_cameras_alone() {
        let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
        let camera = SampleCamera::from(CubeGrid::around(&bounds, 64).expect("a grid").camera(1));
        assert_eq!(SampleCamera::read(camera.write(), "camera"), Ok(camera));
        let refused = Camera::read(camera.write(), "camera").expect_err("no camera of a depth image").to_string();
        assert!(refused.contains("camera.model is parallel"), "{refused}");
        let spoilt = |spoil: &dyn Fn(&mut proto::ParallelCamera)| {
            let Some(Model::Parallel(mut message)) = camera.write().model else { panic!("a parallel camera") };
            spoil(&mut message);
            let refused = SampleCamera::read(proto::Camera { model: Some(Model::Parallel(message)) }, "camera");
            refused.expect_err("a spoilt camera").to_string()
        };
        assert!(spoilt(&|m| m.corner_in_world_m = None).contains("parallel.corner_in_world_m"));
        assert!(spoilt(&|m| m.world_from_camera_unit = None).contains("parallel.world_from_camera_unit"));
        assert!(spoilt(&|m| m.spacing_m = 0.0).contains("spacing_m"));
        assert!(spoilt(&|m| m.range_m = f32::NAN).contains("range_m"));
        assert!(spoilt(&|m| m.width_px = 0).contains("size_px"));
    }

    #[test]
    fn bad_single_pole_cameras_are_refused_by_field() {
        let spoilt = |spoil: &dyn Fn(&mut proto::SinglePoleCamera)| {
            let mut message = camera().write();
            spoil(&mut message);
            let refused = Camera::read(proto::Camera { model: Some(Model::SinglePole(message)) }, "camera");
            refused.expect_err("a spoilt camera").to_string()
        };
        let pole_px = |x| Some(proto::Vec2 { x, y: 3.0 });
        assert!(spoilt(&|m| m.reference = None).contains("single_pole.reference"));
        assert!(spoilt(&|m| m.reference.as_mut().expect("one").near_m = 0.0).contains("near_m"));
        assert!(spoilt(&|m| m.pole_px = None).contains("pole_px"));
        assert!(spoilt(&|m| m.pole_px = pole_px(f32::NAN)).contains("pole_px"));
        assert!(spoilt(&|m| m.pole_px = pole_px(65.0)).contains("pole_px"), "outside of the image");
        assert!(spoilt(&|m| m.distortion_px = -1.0).contains("distortion_px"));
        assert!(spoilt(&|m| m.distortion_px = f32::NAN).contains("distortion_px"));
        assert!(spoilt(&|m| m.distortion_px = 20_000.0).contains("distortion_px"));
        assert!(spoilt(&|m| m.farthest_m = 0.1).contains("farthest_m"));
        assert!(spoilt(&|m| m.farthest_m = f32::INFINITY).contains("farthest_m"));
    }
}
