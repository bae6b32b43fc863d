//! Requests to sample.

use depth_image::Camera;
use render::{DrawWork, SamplePlanes};

use crate::methods::SamplingMethod;

/// Images of a set, and how they are taken.
#[derive(Clone, Copy)]
pub struct SampleWork<'a> {
    /// The scene, its moment and its light.
    pub draw: DrawWork<'a>,
    /// The cameras of the whole set: a later image depends on those before it.
    pub cameras: &'a [Camera],
    /// The images that are taken. Images in sequence are taken all together.
    pub wanted: &'a [u32],
    /// The choice of samples.
    pub method: SamplingMethod,
    /// Planes beside colour and depth.
    pub planes: SamplePlanes,
    /// The moment of the temporal reference, where the method has hysteresis.
    pub temporal_reference_s: Option<f32>,
}
