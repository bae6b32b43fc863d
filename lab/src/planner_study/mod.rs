//! `myriorama-lab study planner`: plans on subjects that nothing was tuned on, against tables of all rows.

mod case;
pub mod command;
mod evidence;
mod pricing;
mod report;
mod subjects;
