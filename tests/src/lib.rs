//! Whole-project tests: architecture and clusters on real processes and ports.
//!
//! Here is what they share: a small scalar device; clusters in one process ([`cluster`]) and in many ([`processes`]);
//! networks that fail ([`proxy`]) and samplers that send what they should not ([`mangler`]); and what a client saw
//! meanwhile ([`watcher`]), held against the invariants ([`history`]).
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod cluster;
pub mod history;
pub mod imports;
pub mod mangler;
pub mod picture;
pub mod processes;
pub mod proxy;
pub mod random;
pub mod raw;
pub mod scalar_engine;
pub mod watcher;
