//! One module a subcommand: its arguments, and what it does.

pub mod coordinator;
pub mod health;
pub mod node;
pub mod replay;
pub mod status;
pub mod up;
pub mod view;
