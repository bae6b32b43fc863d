//! One module a subcommand: its arguments, and what it does.

pub mod bench;
pub mod coordinator;
pub mod demo;
pub mod health;
pub mod node;
pub mod replay;
pub mod status;
pub mod study;
pub mod up;
pub mod view;
