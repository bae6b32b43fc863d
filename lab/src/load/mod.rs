//! A cluster under load: real processes, and many clients with moving cameras.
//!
//! [`processes`] starts a coordinator and nodes and reads their memory; [`clients`] are all in this process; [`phases`]
//! are the loads; [`report`] shows the results.

mod clients;
pub mod command;
mod memory;
mod phases;
pub mod processes;
mod report;
mod statistics;
