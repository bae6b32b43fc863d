//! The compositor's service: one complete sample set, many views.
//!
//! Sets: `fetch` gathers the images of a set from its samplers, or from a compositor that relays them. `fetch_share` talks
//! to one of these nodes, checks and decodes, and `relay_buffer` relays images to other compositors. `sets` keeps those on
//! the device that memory has room for, and fetches the next ahead; `reports` names samplers that fail.
//!
//! Views: `service` answers clients. A `batch_stream` makes every view that is requested, a `live_stream` the newest, whose
//! `course` tells which cell comes next. Views wait in `queue`, live ones, long ones and others in lanes of their own; `render`
//! makes and encodes them batch by batch, and `outbox` sends them. `quota` bounds them all, and `view_times` predicts the
//! time of each. The `auditor` compares some with directly drawn ones.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod auditor;
mod batch;
mod batch_stream;
mod course;
mod fetch;
mod fetch_share;
mod live_stream;
mod outbox;
mod queue;
mod quota;
mod relay_buffer;
mod render;
mod reports;
mod service;
mod sets;
mod shared;
#[cfg(test)]
mod test_support;
mod view_times;

pub use service::CompositorService;
