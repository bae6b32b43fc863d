//! What views are given to show in mirrors and in rough surfaces.

use depth_image::{Aabb, Highlight, MAX_MIRROR_CELLS, MAX_REFLECTIONS};

use crate::{error::ReconstructionError, sample_set::SampleSet};

/// Mirrors within a box, and images of what they show.
#[derive(Clone, Copy)]
pub struct MirrorCell<'s> {
    /// Holds the mirrors' surfaces, with room for the error of depths. Of several boxes around a point the smallest counts.
    pub bounds: Aabb,
    /// The surroundings, as seen from within the box or from its corners, lit like the images of the views.
    pub surroundings: &'s SampleSet,
}

impl MirrorCell<'_> {
    /// A cube without a light field, in which lobes would be gathered.
    pub(super) fn is_plain_cube(&self) -> bool {
        self.surroundings.cube.as_ref().is_some_and(|cube| cube.light_field.is_none())
    }
}

/// The mirrors of a scene, and how many of them a ray meets one after the other.
#[derive(Clone, Copy, Default)]
pub struct Mirrors<'s> {
    /// At most [`MAX_MIRROR_CELLS`]. Mirrors in none of them show lamps and the environment.
    pub cells: &'s [MirrorCell<'s>],
    /// Without any, mirrors show lamps and the environment.
    pub reflections: u32,
    /// Rays into the lobe of a rough surface that a view from a cube shows; in a light field it is gathered instead, whatever their
    /// number. Without any, rough surfaces show lamps and the environment.
    pub glossy_rays: u32,
}

impl Mirrors<'_> {
    /// Without cells where nothing is to be followed: no reflections, or a set without mirrors.
    pub(crate) fn checked_for(self, set: &SampleSet) -> Result<Self, ReconstructionError> {
        if self.cells.len() > MAX_MIRROR_CELLS {
            return Err(ReconstructionError::MirrorCells(self.cells.len()));
        }
        if self.reflections > MAX_REFLECTIONS {
            return Err(ReconstructionError::Reflections(self.reflections));
        }
        let is_own = |cell: &MirrorCell<'_>| std::ptr::eq(cell.surroundings, set);
        if self.cells.iter().any(|cell| !is_own(cell) && cell.surroundings.cameras.is_empty()) {
            return Err(ReconstructionError::NoSamples { what: "a mirror cell".to_owned(), needed: "depth images" });
        }
        let reflectors = set.cube.as_ref().map_or(&set.reflectors, |cube| &cube.reflectors);
        let has_mirrors = reflectors.as_ref().is_some_and(|of| of.highlight == Highlight::Ggx);
        // Without a cube rough surfaces show no scene.
        let is_followed = self.reflections > 0 || (self.glossy_rays > 0 && set.cube.is_some());
        Ok(if is_followed && has_mirrors { self } else { Self::default() })
    }
}
