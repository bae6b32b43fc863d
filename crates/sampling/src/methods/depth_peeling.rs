//! Layers from one place, front to back: the baseline, and the base of layered depth images.

use depth_image::{Camera, PinholeCamera};
use glam::{Mat3, Quat, Vec3};
use render::{Evidence, RedundancyTest};

use crate::error::SamplingError;

/// Layers are drawn from one place, and depths differ by rounding at most.
pub const SAME_LAYER: f32 = 1e-6;
/// The most images of a set, as reconstruction takes them.
const MAX_LAYERS: u32 = 16;
pub(super) const DEFAULT_LAYERS: u32 = 4;

pub(super) const TEST: RedundancyTest =
    RedundancyTest { shader: "depth_peeling.wgsl", consults: Evidence::Samples, from_one_place: true };

pub(super) fn parse_layers(text: &str) -> Option<u32> {
    text.parse().ok().filter(|layers| (1..=MAX_LAYERS).contains(layers))
}

/// One camera in the middle of a rig, for each layer; it looks as the rig's cameras do together.
pub(super) fn cameras(rig: &[PinholeCamera], layers: usize) -> Vec<PinholeCamera> {
    let Some(first) = rig.first() else { return Vec::new() };
    let count = rig.len() as f32;
    let eyes: Vec3 = rig.iter().map(|camera| camera.eye_in_world).sum();
    let backwards: Vec3 = rig.iter().map(|camera| camera.world_from_camera * Vec3::Z).sum();
    let backwards = (backwards / count).normalize_or(first.world_from_camera * Vec3::Z);
    let up = first.world_from_camera * Vec3::Y;
    let right = up.cross(backwards).normalize_or(first.world_from_camera * Vec3::X);
    let axes = Mat3::from_cols(right, backwards.cross(right), backwards);
    let middle = PinholeCamera { eye_in_world: eyes / count, world_from_camera: Quat::from_mat3(&axes), ..*first };
    vec![middle; layers]
}

/// Checks that all layers have one camera.
///
/// # Errors
/// For layers that are not all of one camera.
pub(super) fn check(cameras: &[Camera]) -> Result<(), SamplingError> {
    let other = cameras.iter().position(|camera| *camera != cameras[0]);
    other.map_or(Ok(()), |index| Err(SamplingError::Layer { index }))
}
