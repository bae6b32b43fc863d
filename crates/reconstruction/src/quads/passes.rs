//! Passes that list, draw and resolve quads.

use std::sync::Arc;

use gpu::{Frame, Gpu, PassCache, Templates};

use super::{
    count::{self, Count},
    cut::ImageCut,
    draw::{self, QuadDrawing},
    indices::{self, Indices},
    mesh::{Mesh, QuadVertices},
    resolve::{self, Resolve},
    scan::{self, Scan},
};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// Passes that list, draw and resolve quads.
pub(crate) struct QuadPasses {
    count: PassCache<Count>,
    scan: PassCache<Scan>,
    indices: PassCache<Indices>,
    drawing: QuadDrawing,
    resolve: PassCache<Resolve>,
}

impl QuadPasses {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self {
            count: PassCache::new(gpu, templates),
            scan: PassCache::new(gpu, templates),
            indices: PassCache::new(gpu, templates),
            drawing: QuadDrawing::new(gpu, templates),
            resolve: PassCache::new(gpu, templates),
        }
    }

    /// Lists an image's quads, by the extents that were cut.
    pub fn list(
        &self,
        frame: &mut Frame<'_>,
        image: &ImageCut<'_>,
        vertices: QuadVertices,
    ) -> Result<(), ReconstructionError> {
        let counts = image.device.buffers.lend_storage("quads of chunks", 4 * u64::from(image.chunks()));
        count::record(&self.count, frame, image, &counts)?;
        scan::record(&self.scan, frame, image, &counts)?;
        indices::record(&self.indices, frame, image, vertices, &counts)
    }

    /// Draws a mesh into all views and gives pixels their colour; gives the pixels that stay unknown.
    pub fn record(&self, recording: &mut Recording<'_>, mesh: &Mesh) -> Result<PixelList, ReconstructionError> {
        let drawn = draw::record(&self.drawing, recording, mesh)?;
        resolve::record(&self.resolve, recording, &drawn)
    }
}
