//! Cameras and bounds.

use cluster::InvalidField;
use depth_image::{Aabb, Camera, PinholeCamera, SinglePoleCamera};
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
}

nested!(Vec3 = Vec3, PinholeCamera = PinholeCamera);

impl Convert<proto::Vec3> for Vec3 {
    fn read(v: proto::Vec3, field: &'static str) -> Result<Self, WireError> {
        let v = Self::new(v.x, v.y, v.z);
        if v.is_finite() { Ok(v) } else { Err(InvalidField::out_of_range(field, v, "finite").into()) }
    }

    fn write(self) -> proto::Vec3 {
        proto::Vec3 { x: self.x, y: self.y, z: self.z }
    }
}

impl Convert<proto::PinholeCamera> for PinholeCamera {
    fn read(camera: proto::PinholeCamera, field: &'static str) -> Result<Self, WireError> {
        let eye = required(camera.eye_in_world_m, "camera.eye_in_world_m")?;
        let turn = required(camera.world_from_camera_unit, "camera.world_from_camera_unit")?;
        let camera = Self {
            eye_in_world: Vec3::new(eye.x, eye.y, eye.z),
            world_from_camera: Quat::from_xyzw(turn.x, turn.y, turn.z, turn.w),
            focal_px: Convert::read(camera.focal_px, "camera.focal_px")?,
            principal_px: Convert::read(camera.principal_px, "camera.principal_px")?,
            size_px: UVec2::new(camera.width_px, camera.height_px),
            near_m: camera.near_m,
        };
        camera.validate().map_err(|source| InvalidField::Camera { field, source })?;
        Ok(camera)
    }

    fn write(self) -> proto::PinholeCamera {
        let q = self.world_from_camera;
        proto::PinholeCamera {
            eye_in_world_m: self.eye_in_world.write(),
            world_from_camera_unit: Some(proto::Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }),
            focal_px: self.focal_px.write(),
            principal_px: self.principal_px.write(),
            width_px: self.size_px.x,
            height_px: self.size_px.y,
            near_m: self.near_m,
        }
    }
}

impl Convert<proto::SinglePoleCamera> for SinglePoleCamera {
    fn read(camera: proto::SinglePoleCamera, field: &'static str) -> Result<Self, WireError> {
        let reference = required(camera.reference, "camera.single_pole.reference")?;
        let camera = Self {
            reference: PinholeCamera::read(reference, "camera.single_pole.reference")?,
            pole_px: Convert::read(camera.pole_px, "camera.single_pole.pole_px")?,
            distortion_px: camera.distortion_px,
            farthest_m: camera.farthest_m,
        };
        camera.validate().map_err(|source| InvalidField::Camera { field, source })?;
        // Tiles, which do not hold the pole of their image, do not travel.
        if !camera.reference.contains(camera.pole_px) {
            return Err(InvalidField::out_of_range("camera.single_pole.pole_px", camera.pole_px, "in the image").into());
        }
        Ok(camera)
    }

    fn write(self) -> proto::SinglePoleCamera {
        proto::SinglePoleCamera {
            reference: Some(self.reference.write()),
            pole_px: self.pole_px.write(),
            distortion_px: self.distortion_px,
            farthest_m: self.farthest_m,
        }
    }
}

impl Convert<proto::Camera> for Camera {
    fn read(camera: proto::Camera, _: &'static str) -> Result<Self, WireError> {
        match required(camera.model, "camera.model")? {
            Model::Pinhole(pinhole) => PinholeCamera::read(pinhole, "camera.pinhole").map(Self::Pinhole),
            Model::SinglePole(camera) => SinglePoleCamera::read(camera, "camera.single_pole").map(Self::SinglePole),
        }
    }

    fn write(self) -> proto::Camera {
        let model = match self {
            Self::Pinhole(camera) => Model::Pinhole(camera.write()),
            Self::SinglePole(camera) => Model::SinglePole(camera.write()),
        };
        proto::Camera { model: Some(model) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
