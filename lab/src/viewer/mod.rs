//! `bench viewer`: the viewer in a real browser, before a gateway, a coordinator and two nodes as processes.
//!
//! Each part is a [`crate::section`] of the report, measured on a `stand` of its own through its `page`.

pub mod command;

mod dragging;
mod faults;
mod first_picture;
mod memory;
mod page;
mod rest;
mod slow_link;
mod stand;
mod walk;
