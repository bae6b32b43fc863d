//! Measurements of the program: speed, accuracy and scaling, each as a report.
//!
//! [`demo`] is the paper's experiment on this machine. [`bench`] compares measured values with bars. [`load`] and
//! [`scaling`] start clusters of processes. [`sampling_study`] repeats the experiments of a paper on sampling. A thin
//! build of the program has none of this.
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod bench;
mod command;
pub mod cpu_share;
pub mod demo;
pub mod evaluation;
pub mod experiment;
pub mod lighting_study;
pub mod load;
pub mod memory;
pub mod process;
pub mod progress;
pub mod reference_views;
pub mod sampling_study;
pub mod scaling;
pub mod statistics;
pub mod sweep;

pub use command::LabCommand;
