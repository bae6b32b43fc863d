//! Views under expensive light: subjects, lightings, true views, and the time of direct drawing at equal error.
//!
//! `study light_cache` and `study fronts` measure the same subjects in the same way.

pub mod light;
pub mod measure;
pub mod subject;
