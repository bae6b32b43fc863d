//! `bench promise`: the price of promises to a viewer, and the time until a broken one is replaced.
//!
//! A [`live_viewer::Cluster`] is a process with a budget, [`live_viewer::Viewer`] a live viewer of it. `price`, `broken` and `walk` are the
//! parts of the report.

pub mod command;

mod broken;
mod forged;
mod live_viewer;
mod price;
mod walk;
