//! The planes of `sums.wgsl`: light that has arrived so far, for each pixel.

use depth_image::SpecularPlanes;
use gpu::light_slots;
use minijinja::{Value, context};

/// Planes of colour, before those that say what rays met.
pub(crate) const COLOR_SUMS: u32 = 6;

/// The quantities that are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(crate) struct SumPlanes {
    pub light_count: usize,
    /// Counts of unblocked rays to each light, for highlights.
    pub visibility: bool,
}

impl SumPlanes {
    /// Few and many lights, with and without visibility.
    pub fn all() -> impl Iterator<Item = Self> {
        [0, 1, 9].into_iter().flat_map(|light_count| [false, true].map(|visibility| Self { light_count, visibility }))
    }

    /// Planes of a pixel.
    pub fn count(self) -> usize {
        COLOR_SUMS as usize + if self.visibility { self.light_count + 1 } else { 0 }
    }

    /// Words of packed visibility of a pixel.
    pub fn visibility_words(self) -> usize {
        if self.visibility { SpecularPlanes::visibility_planes(self.light_count) } else { 0 }
    }

    pub fn context(self) -> Value {
        let Self { light_count, visibility } = self;
        let visibility_words = self.visibility_words();
        context! { light_count, visibility, visibility_words, light_slots => light_slots(light_count) }
    }
}
