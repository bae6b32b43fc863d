//! Views under expensive light: shared light beside direct drawing at equal error.
//!
//! `study light_cache` and `study fronts` measure the same rows on the same kinds of subject.

mod direct;
pub mod fronts;
pub mod light;
pub mod light_cache;
mod measure;
mod report;
mod subject;
