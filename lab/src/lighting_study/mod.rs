//! Lightings compared: the cost of light, and the gain of sharing it.

mod charts;
mod measure;
mod report;
mod tables;

pub use measure::{Extent, FINE, measure};
pub use report::{checks, report};
