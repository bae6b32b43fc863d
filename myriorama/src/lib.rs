//! The program `myriorama`: one binary that is a cluster, a part of one, its client, and its own judge.
//!
//! [`engine`] binds the device crates to the services' boundary; [`setup`] makes a scene on offer out of
//! arguments; [`cluster`] runs coordinator and nodes in one process; [`rig`] places views, [`cameras`] reads
//! and writes them; each of [`commands`] is one subcommand of [`cli`].
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod cameras;
pub mod cli;
pub mod cluster;
pub mod commands;
pub mod comparison;
pub mod delivery;
pub mod engine;
pub mod evaluate;
pub mod exit;
pub mod experiment;
pub mod fallbacks;
pub mod lighting_study;
pub mod live;
pub mod load;
pub mod pictures;
pub mod process;
pub mod processes;
pub mod progress;
pub mod sampling_study;
pub mod scaling;
pub mod setup;
pub mod sizes;
pub mod status_text;
pub mod sweep;
pub mod terminal_picture;
pub mod text_table;
