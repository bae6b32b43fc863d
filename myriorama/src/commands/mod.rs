//! Subcommands: one module each, with its arguments.

pub mod coordinator;
pub mod demo;
pub mod gateway;
pub mod health;
pub mod node;
pub mod plan;
pub mod replay;
pub mod status;
pub mod up;
pub mod view;
