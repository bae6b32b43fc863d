//! The compositor's service: one complete sample set, many views.
//!
//! `fetch` pulls a set from its samplers, or from a compositor that passes it on (`passing`), `incoming` checks and decodes
//! what comes, `sets` keeps the last few on
//! the device and fetches the next ahead. `service` answers clients: `batch_stream` those that want every view they ask
//! for, `live_stream` those that want the newest. Views wait in `arrivals`, where `queue` says whose turn it is; `render`
//! makes and encodes them batch by batch, and `outbox` sends them. `quota` bounds all of it.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod arrivals;
mod batch;
mod batch_stream;
mod fetch;
mod incoming;
mod live_stream;
mod outbox;
mod passing;
mod queue;
mod quota;
mod render;
mod reports;
mod service;
mod sets;

pub use service::CompositorService;
