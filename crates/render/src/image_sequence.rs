//! Images of a set, each of which leaves out the samples that those before it hold.

use depth_image::PinholeCamera;
use glam::UVec2;
use gpu::{Binding, Gpu, ShaderError};

use crate::known_samples::{KnownSamples, RedundancyVariant};

/// The images of a set that are drawn one after the other.
#[derive(Clone, Copy)]
pub(crate) struct ImageSequence<'a> {
    pub known: &'a KnownSamples,
    /// Places in the set of the images to be drawn, and which of them is the batch's first.
    pub wanted: &'a [u32],
    pub first: usize,
    /// Whether the images' samples are kept for those after them.
    pub keeps: bool,
}

impl<'a> ImageSequence<'a> {
    /// The place in its set of an image of the batch, which is also the number of images before it.
    pub fn number(&self, place: usize) -> usize {
        self.wanted[self.first + place] as usize
    }

    /// The images before the one at this place of the batch, if there are any.
    pub fn predecessors(self, place: usize, camera: &'a PinholeCamera) -> Option<Predecessors<'a>> {
        let count = self.number(place);
        (count > 0).then_some(Predecessors { known: self.known, camera, count })
    }

    /// The layer that an image's surface ids are drawn into for images after it, and the layer's size.
    pub fn surface_ids(&self, place: usize) -> Option<(wgpu::TextureView, UVec2)> {
        let ids = self.keeps.then(|| self.known.surface_ids(self.number(place))).flatten();
        ids.map(|ids| (ids.clone(), self.known.size_px()))
    }

    /// The layer that an image's samples are kept in for images after it.
    pub fn samples(&self, place: usize) -> Option<&'a wgpu::TextureView> {
        self.keeps.then(|| self.known.samples(self.number(place))).flatten()
    }
}

/// The images before one, whose samples it does not show again.
#[derive(Clone, Copy)]
pub(crate) struct Predecessors<'a> {
    known: &'a KnownSamples,
    camera: &'a PinholeCamera,
    count: usize,
}

impl Predecessors<'_> {
    pub fn variant(self) -> RedundancyVariant {
        self.known.variant(self.count)
    }

    /// Binds the variables of `known_samples.wgsl`.
    pub fn bind(
        self,
        gpu: &Gpu,
        bind: impl FnOnce(Vec<Binding<'_>>) -> Result<wgpu::BindGroup, ShaderError>,
    ) -> Result<wgpu::BindGroup, ShaderError> {
        self.known.bind(gpu, self.camera, self.count, bind)
    }
}
