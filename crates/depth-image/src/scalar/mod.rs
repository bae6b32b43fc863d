//! What shaders compute, one value after another in plain `f32`: for tests, scalar twins and studies.

mod encoding;
mod environment;
mod highlight;
mod light;
mod texel;

pub use encoding::unit_from_oct16;
pub use highlight::{environment_highlight_linear, environment_reflectance_linear, highlight_linear};
pub use light::{Incident, disc_from_square, tangents_of};
pub use texel::Texel;
