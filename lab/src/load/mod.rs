//! A cluster under load: real processes, and many clients with moving cameras.
//!
//! [`clients`] are all in this process; [`phases`] are the loads; [`report`] shows the results.

mod clients;
pub mod command;
mod memory;
mod phases;
mod report;
mod statistics;
