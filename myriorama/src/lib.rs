//! The program `myriorama`: a whole cluster, a part of one, or its client.
//!
//! Each of [`commands`] is one subcommand of [`cli`].
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod cli;
pub mod commands;
pub mod serving;
pub mod tone;
pub mod viewer;
