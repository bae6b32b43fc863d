//! The paper's experiments on real processes, and a simulation that goes on where they end.
//!
//! [`take`] starts a coordinator and P nodes, gives every node an equal share of the processors, and measures the time
//! between two sample sets by number of nodes, number of views and policy. See `docs/scaling.md`.

mod charts;
mod checks;
pub mod command;
mod costs;
mod counters;
mod cpu_share;
mod fetched;
mod fleet;
mod foretold;
mod machine;
mod matrix;
mod measured;
mod paper;
mod point;
mod report;
mod subject;
mod sweep;
mod sweep_report;
mod tables;
mod whole_images;

pub use costs::efficiency;
pub use cpu_share::{CpuGroup, CpuShareError, Hierarchy, Usage};
pub use matrix::{Extent, FEW_NODES, HEADLINE_VIEWS, PAPER_NODES, PAPER_VIEWS};
pub use measured::{Lit, Measured, Request, default_quota, take};
pub use point::{Ask, Point, Steps, Window};
pub use report::{report, show};
pub use subject::Subject;
