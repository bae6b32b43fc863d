//! A cluster of any size, simulated: the real schedule, and a model of nodes and networks.
//!
//! [`plan`] asks the real [`coordinator::schedule::Scheduler`], event by event, as the coordinator does. [`run`] then
//! executes the plan in a made-up cluster. A device does one job at a time, and a link carries one parcel at a time in each
//! direction. Compositors ask for sets, hand views over and batch them as the services do. Nothing here reads
//! a clock or draws a random number that is not from a seed: the same cluster gives the same times.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod cluster;
mod distribution;
mod node;
mod planning;
mod run;
mod world;

#[cfg(test)]
mod faults_tests;
#[cfg(test)]
mod tests;

pub use cluster::{Calls, Cluster, Habits, Machine, Transfer, spread_speeds};
pub use planning::{Demand, plan};
pub use run::{Busy, Limit, Run};
pub use world::run;
