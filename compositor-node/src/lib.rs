//! The compositor's service: one complete sample set, many views.
//!
//! `fetch` pulls a set from its samplers, `sets` keeps the last few on the device and fetches the next
//! ahead, `batch` groups waiting views, `render` makes and encodes them, `service` answers clients.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod batch;
mod fetch;
mod output;
mod render;
mod service;
mod sets;

pub use service::CompositorService;
