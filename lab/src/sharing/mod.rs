//! `bench sharing`: a viewer beside other clients of one cluster, and what sharing must not change.
//!
//! Each part is a [`crate::section`] of the report, measured on processes of its own: `beside` has the guests, the other modules
//! are named after their parts.

pub mod command;

mod beside;
mod guests;
mod killed_compositor;
mod report;
mod up;
mod viewer;

#[cfg(test)]
mod tests;
