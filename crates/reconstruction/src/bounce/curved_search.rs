//! The walk along curved rays in images of single-pole cameras: `curved_search.wgsl`.

use gpu::shader_variant;

use crate::error::ReconstructionError;
use crate::view_work::{ONE_VIEW, SetVariant};

/// Steps of a ray in one image; the end of one that takes more is unknown.
pub(crate) const MAX_WALK_STEPS: u32 = 16_384;
/// The ends of a fine step on one surface are no farther apart, in fine steps.
pub(crate) const LONGEST_STEP: f32 = 4.0;

const LEAST_FINE_PX: f32 = 0.0625;
const MOST_COARSE_PX: f32 = 64.0;

/// The steps of a walk (Rosen et al., section 7.2), in texels of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvedSearch {
    /// Of the steps that are taken first.
    pub coarse_px: f32,
    /// Of those where a coarse step may meet the surface; at most `coarse_px`. As long as those, no step is refined.
    pub fine_px: f32,
}

impl CurvedSearch {
    /// Fails for steps of no length, too long ones, and fine ones that are longer than coarse ones.
    pub(crate) fn checked(self) -> Result<Self, ReconstructionError> {
        let Self { coarse_px, fine_px } = self;
        let is_usable = fine_px >= LEAST_FINE_PX && fine_px <= coarse_px && coarse_px <= MOST_COARSE_PX;
        is_usable.then_some(self).ok_or(ReconstructionError::CurvedSearch { coarse_px, fine_px })
    }
}

impl Default for CurvedSearch {
    fn default() -> Self {
        Self { coarse_px: 6.0, fine_px: 1.0 }
    }
}

shader_variant!(CurvedWalk(SetVariant), "bounce/curved_search.wgsl", ONE_VIEW);
