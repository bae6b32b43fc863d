//! Layers from one place, front to back: the baseline, and the base of layered depth images.

use depth_image::{Camera, PinholeCamera};
use glam::{Mat3, Quat, Vec3};
use render::{Asks, LeaveOut};

use crate::SamplingError;

const SHADER: &str = "depth_peeling.wgsl";

pub(crate) const SHADERS: [(&str, &str); 1] = [(SHADER, include_str!("depth_peeling.wgsl"))];

pub(crate) const TEST: LeaveOut =
    LeaveOut { shader: SHADER, asks: Asks::Samples, from_one_place: true, settled: false, only_useful: false };

/// One camera in the middle of a rig, for each layer; it looks as the rig's cameras do together.
pub(crate) fn cameras(rig: &[PinholeCamera], layers: usize) -> Vec<PinholeCamera> {
    let Some(first) = rig.first() else { return Vec::new() };
    let mean = |of: fn(&PinholeCamera) -> Vec3| rig.iter().map(of).sum::<Vec3>() / rig.len() as f32;
    let backwards = mean(|camera| camera.world_from_camera * Vec3::Z).normalize_or(first.world_from_camera * Vec3::Z);
    let up = first.world_from_camera * Vec3::Y;
    let right = up.cross(backwards).normalize_or(first.world_from_camera * Vec3::X);
    let axes = Mat3::from_cols(right, backwards.cross(right), backwards);
    let middle = PinholeCamera {
        eye_in_world: mean(|camera| camera.eye_in_world),
        world_from_camera: Quat::from_mat3(&axes),
        ..*first
    };
    vec![middle; layers]
}

/// # Errors
/// For layers that are not all of one camera.
pub(crate) fn check(cameras: &[Camera]) -> Result<(), SamplingError> {
    let other = cameras.iter().position(|camera| *camera != cameras[0]);
    other.map_or(Ok(()), |index| Err(SamplingError::Layer { index }))
}
