//! Measurements of the program: speed, accuracy and scaling, each as a report.
//!
//! [`demo`] is the paper's experiment on this machine, [`bench`] holds measured values against bars, [`load`] and
//! [`scaling`] start clusters of processes, and [`sampling_study`] repeats the experiments of a paper on sampling. All
//! of it is left out of a thin build of the program.
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod bench;
mod command;
pub mod demo;
pub mod evaluate;
pub mod experiment;
pub mod lighting_study;
pub mod load;
pub mod memory;
pub mod process;
pub mod progress;
pub mod sampling_study;
pub mod scaling;
pub mod sweep;

pub use command::LabCommand;
