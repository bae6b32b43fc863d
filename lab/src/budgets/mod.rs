//! `myriorama-lab study planner`: plans for budgets against tables of all rows, on views that no plan sees.

pub mod command;
mod defaults;
mod held_out;
pub mod report;
mod table;
#[cfg(test)]
mod tests;
