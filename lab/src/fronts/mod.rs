//! `myriorama-lab study fronts`: cost against error of every representation among which a budget chooses, and of shared
//! light under expensive light.

mod checks;
pub mod command;
mod measure;
pub mod report;
mod row;
pub mod subject;
#[cfg(test)]
mod tests;
