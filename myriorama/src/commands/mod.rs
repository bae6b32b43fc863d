//! One module a subcommand: its arguments, and what it does.

pub mod bench;
pub mod coordinator;
pub mod demo;
pub mod node;
pub mod study;
pub mod up;
pub mod view;
