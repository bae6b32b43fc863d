//! The paper's experiments on real processes, and a simulation beyond them.
//!
//! [`command`] starts a coordinator and P nodes, each with an equal share of the processors. It measures the time
//! between two sample sets by number of nodes, number of views and policy. See `docs/scaling.md`.

mod charts;
mod checks;
pub mod command;
mod costs;
mod fetched;
mod machine;
mod matrix;
mod measure;
mod measure_point;
mod nodes;
mod paper;
mod point;
mod prediction;
mod report;
mod results;
mod subject;
mod sweep;
mod tables;
