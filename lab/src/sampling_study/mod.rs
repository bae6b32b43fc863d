//! Sampling methods compared: the metrics of Xie §6.1.2 on the kinds of scene that the paper has.

mod availability;
pub mod command;
mod counts;
mod detection;
mod extent;
mod methods;
mod pictures;
mod reconstructions;
mod sizes;
mod subject;
mod tables;
mod times;
mod visibility;

pub use extent::Extent;
pub use subject::{SCENES, Subject};
pub use times::{times, times_report};
