//! Sampling methods compared: the metrics of Xie §6.1.2 on the kinds of scene that the paper has.

mod availability;
pub mod command;
mod counts;
mod detection;
mod distances;
mod extent;
mod held;
mod methods;
mod paper;
mod pictures;
mod scene;
mod sizes;
mod subject;
mod tables;
mod times;
mod visibility;

pub(crate) use detection::found_redundant;
