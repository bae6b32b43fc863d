//! From the middle of the floor to the walls, and the height, in metres.

pub(super) const HALF_LENGTH_M: f32 = 6.0;
pub(super) const HALF_WIDTH_M: f32 = 4.0;
pub(super) const HEIGHT_M: f32 = 4.2;
