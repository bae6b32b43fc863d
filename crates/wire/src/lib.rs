//! The contract on the wire: protobuf messages, their conversion to types of `cluster` and `codec`, and gRPC services in
//! terms of these.
//!
//! Only this crate names prost messages. A conversion refuses what its type does not allow, with an error that names the
//! field.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod convert;
mod error;
mod proto;
mod refusal;
pub mod rpc;

#[cfg(test)]
mod budget_message_tests;
#[cfg(test)]
mod conventions_tests;
#[cfg(test)]
mod message_tests;

pub use error::{PROTOCOL_VERSION, WireError};
pub use refusal::{plan_in_force, refuse_plan};
