//! Whole-project tests: architecture and clusters on real processes and ports.
//!
//! The tests share a small scalar device, and clusters in one process ([`cluster`]) and in many ([`processes`]). They
//! share samplers that send corrupt data ([`mangler`]). A client records its frames
//! ([`watcher`]), which are checked against the invariants ([`history`]). Viewers walk around ([`walkers`]), and pages through
//! a gateway ([`gateway_bench`]).
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod cluster;
pub mod gateway_bench;
pub mod history;
pub mod imports;
pub mod mangler;
pub mod picture;
pub mod processes;
pub mod raw;
pub mod scalar_engine;
pub mod scalar_process;
pub mod walkers;
pub mod watcher;
