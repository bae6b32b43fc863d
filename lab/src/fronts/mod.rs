//! `myriorama-lab study fronts`: cost against error of every representation among which a budget chooses, and of shared
//! light under expensive light.

mod checks;
pub mod command;
pub(crate) mod conditions;
mod expensive;
mod measure;
mod order;
pub mod report;
pub(crate) mod row;
pub(crate) mod subject;
#[cfg(test)]
mod tests;
