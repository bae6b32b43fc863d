//! A cluster under load: real processes, many clients that move, and what each of them gets.
//!
//! [`processes`] starts a coordinator and nodes, and reads their memory; [`crowd`] is the clients, all in this process;
//! [`phases`] are the loads; [`report`] says what came of them.

pub mod command;
pub mod crowd;
pub mod phases;
pub mod processes;
pub mod report;

pub use phases::{Load, Phases, run};
