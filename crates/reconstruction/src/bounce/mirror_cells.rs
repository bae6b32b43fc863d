//! What views are given to show in mirrors and in rough surfaces.

use depth_image::{Aabb, Highlight, MAX_MIRROR_CELLS, MAX_REFLECTIONS};
use glam::Vec3;

use crate::reflectors::Reflectors;
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
    /// Its surroundings are a cube: the base, or the set of a view from a cube.
    pub(crate) fn is_cube(&self) -> bool {
        self.surroundings.cube.is_some()
    }
}

/// The mirrors of a scene, and how many of them a ray meets one after the other.
#[derive(Clone, Copy, Default)]
pub struct Mirrors<'s> {
    /// At most [`MAX_MIRROR_CELLS`]. Mirrors in none of them show what the base holds; without a base, lamps and the environment.
    pub cells: &'s [MirrorCell<'s>],
    /// Without any, mirrors show lamps and the environment.
    pub reflections: u32,
    /// Rays into the lobe of a rough surface, which are walked in the cube of the view or in a base; in a light field it is gathered
    /// instead, whatever their number. Without any, and without a cube, rough surfaces show lamps and the environment.
    pub glossy_rays: u32,
}

impl<'s> Mirrors<'s> {
    /// Without rays off mirrors where nothing mirrors the scene, and without rays into lobes where nothing reflects. `cube` is the base, or
    /// the set itself where it is a cube.
    pub(crate) fn checked_for(self, set: &SampleSet, cube: Option<&SampleSet>) -> Result<Self, ReconstructionError> {
        if self.cells.len() > MAX_MIRROR_CELLS {
            return Err(ReconstructionError::MirrorCells(self.cells.len()));
        }
        if self.reflections > MAX_REFLECTIONS {
            return Err(ReconstructionError::Reflections(self.reflections));
        }
        if self.cells.iter().any(|cell| cell.surroundings.cameras.is_empty()) {
            return Err(ReconstructionError::NoSamples { what: "a mirror cell".to_owned(), needed: "depth images" });
        }
        let all = [set.reflectors.as_ref(), cube.and_then(reflectors_of_cube)];
        let reflecting: Vec<&Reflectors> =
            all.into_iter().flatten().filter(|of| of.highlight == Highlight::Ggx).collect();
        let off_mirrors = if reflecting.iter().any(|of| of.has_mirrors) { self } else { Self::default() };
        // Without a cube rough surfaces show no scene.
        let glossy_rays = if cube.is_some() && !reflecting.is_empty() { self.glossy_rays } else { 0 };
        Ok(Self { glossy_rays, ..off_mirrors })
    }

    /// The rays off mirrors, and those into lobes where they are followed apart: beside images, and in the base alone.
    pub(crate) fn split(self, has_base: bool) -> [Self; 2] {
        match has_base && self.glossy_rays > 0 {
            true => [Self { glossy_rays: 0, ..self }, Self { cells: &[], ..self }],
            false => [self, Self::default()],
        }
    }

    /// The cells in which rays are followed, if any are: the cube comes last, since it holds the mirrors that are in no other.
    pub(crate) fn cells_with(&self, cube: Option<&'s SampleSet>) -> Vec<MirrorCell<'s>> {
        if self.reflections == 0 && self.glossy_rays == 0 {
            return Vec::new();
        }
        let everywhere = Aabb { min: Vec3::splat(f32::MIN), max: Vec3::splat(f32::MAX) };
        let cube = cube.map(|surroundings| MirrorCell { bounds: everywhere, surroundings });
        self.cells.iter().copied().chain(cube).collect()
    }
}

/// What the samples of a cube reflect, where any does.
pub(super) fn reflectors_of_cube(set: &SampleSet) -> Option<&Reflectors> {
    set.cube.as_ref()?.reflectors.as_ref()
}
