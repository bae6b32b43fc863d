//! Measurements of the program: speed, accuracy and scaling, each as a report.
//!
//! [`demo`] is the paper's experiment on this machine. [`bench`] compares measured values with bars. [`load`] and
//! [`scaling`] start clusters of processes. [`sampling_study`] repeats the experiments of a paper on sampling.
//! `failures` holds the shapes of curves of errors. A thin build of the program has none of this.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod balance;
mod bench;
mod command;
mod compare;
mod cpu_share;
mod demo;
mod evaluation;
mod experiment;
mod failures;
mod fronts;
mod impostors;
mod layered;
mod lighting_study;
mod load;
mod memory;
mod placement;
mod planner_study;
mod process;
mod progress;
mod promise;
pub mod reference_views;
pub mod sampling_study;
mod scaling;
mod scene_args;
mod section;
mod sharing;
mod stability;
pub mod statistics;
mod sweep;
mod view_errors;
mod viewer;

pub use command::LabCommand;
pub use evaluation::Evaluation;
pub use scene_args::scene_args;
