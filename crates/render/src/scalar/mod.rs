//! The scalar reference of this crate, for tests: every ray against every triangle, and twins of the shaders that
//! trace rays and gather light, which do the same on the same data, one ray after another.

pub mod glass;
pub mod hashed_alpha;
mod indirect;
mod lamp_bits;
pub mod light_cache;
pub mod lobe;
mod nearest;
pub mod rays;
pub mod reflections;
pub mod sequence;

pub use crate::light_samples::{PLANE_FOOTPRINTS, TURNED_DEG};
pub use crate::smooth_light::smoothed;
pub use crate::{coverage::MOST_COARSER, known_samples::LEAST_FACING, rays::primary::MOST_LAYERS};
pub use lamp_bits::{LitPoint, bits_of_lamp, faces, grid_place, seen_in_map};
pub use nearest::{Nearest, inverse_depth_per_m, nearest};
