//! Charts: their data, and their drawing as SVG.

mod axis;
mod canvas;
mod marker;
mod palette;
mod ruler;
mod series;
mod xy;

pub use axis::{Axis, Scale};
pub(crate) use palette::Palette;
pub use series::{Limit, Mark, Point, Series};
pub use xy::XyChart;
