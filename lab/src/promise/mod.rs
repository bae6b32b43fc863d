//! `bench promise`: the price of promises to a viewer, and the time until a broken one is replaced.
//!
//! A [`watched::Cluster`] is a process with a budget, [`watched::Viewer`] a live viewer of it. `price` and `broken` are the parts
//! of the report.

pub mod command;

mod broken;
mod forged;
mod price;
mod watched;
