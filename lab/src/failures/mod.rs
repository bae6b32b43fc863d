//! Where methods fail, as data: curves with the shapes that they must have, in one list for tests and for the study.

pub mod cached_light;
pub mod command;
mod cubes;
mod curve;
mod curves;
pub mod measures;
mod report;
mod shape;
pub mod stage;
pub mod stand;
#[cfg(test)]
mod tests;
