//! A share of the machine's processors for each node: a control group of Linux with a quota.
//!
//! The kernel lets a group run for its quota in every period and then stops it until the next one. Several nodes on few
//! cores are then as slow as if each had a slow processor of its own. Both versions of control groups work.

mod error;
mod group;
mod hierarchy;
mod own_group;
mod usage;

pub use group::CpuGroup;
pub use hierarchy::Hierarchy;
pub use own_group::OwnGroup;
pub use usage::Usage;
