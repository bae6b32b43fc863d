//! What shaders compute, one value after another in plain `f32`: for tests, scalar twins and studies.

mod encoding;
mod highlight;
mod light;
mod texel;

pub use encoding::{linear_from_rgb9e5, rgb9e5_from_linear, unit_from_oct16};
pub use highlight::highlight_linear;
pub use light::{Incident, disc_from_square, tangents_of};
pub use texel::Texel;
