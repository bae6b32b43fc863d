//! Requests to sample.

use depth_image::Camera;
use render::{DrawWork, SamplePlanes};

use crate::methods::SamplingMethod;

/// Images of a set, and how they are taken.
#[derive(Clone, Copy)]
pub struct SampleWork<'a> {
    /// The scene, its moment and its light.
    pub draw: DrawWork<'a>,
    /// The cameras of the whole set: a later image may depend on those before it.
    pub cameras: &'a [Camera],
    /// T: each image is cut into this many tiles, one above the other; 1 for whole images.
    pub tile_count: u32,
    /// The tiles that are taken: those of image i are i · T to (i + 1) · T - 1. Images in sequence are taken all together, and whole.
    pub wanted: &'a [u32],
    /// The choice of samples.
    pub method: SamplingMethod,
    /// Planes beside colour and depth.
    pub planes: SamplePlanes,
}

impl SampleWork<'_> {
    /// The cameras of the wanted tiles, and the places in the set of their images.
    pub(crate) fn tiles(&self) -> (Vec<Camera>, Vec<u32>) {
        let tiles = self.wanted.iter().map(|wanted| {
            let number = wanted / self.tile_count;
            (self.cameras[number as usize].tile(wanted % self.tile_count, self.tile_count), number)
        });
        tiles.unzip()
    }
}
