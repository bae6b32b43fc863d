//! Fronts under expensive light: views whose light comes from samples, views from images alone, and direct drawing.
//!
//! The rows are not those of the ladder: the planner does not choose among qualities of shared light, and direct drawing
//! has an error here, the noise of its few rays.

pub mod checks;
mod measure;
pub mod report;
pub mod rows;
pub mod subjects;

pub use measure::LightFront;
