//! Views under expensive light: shared light beside direct drawing at equal error.
//!
//! `study light_cache`, `study fronts` and `study sampling` measure the same rows on the same kinds of subject.

mod direct;
mod fronts;
pub mod fronts_command;
pub mod light;
pub mod light_cache;
mod measure;
mod report;
pub mod sampling;
mod subject;
