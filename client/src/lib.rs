//! Thin client library: request views, receive frames. Links no wgpu.
//!
//! A [`Client`] knows the coordinator; a [`Session`] has a plan and talks to the compositors alone. [`Frames`] are those of
//! one request, whose `window` is drawn from any number of views. `delivery` requests them as one `batch` from all compositors, whose streams
//! draw from one [`ViewQueue`]. A [`LiveView`] is a camera that moves.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod active_plan;
mod batch;
mod delivery;
mod error;
mod frames;
mod live_stream;
mod live_view;
mod pace;
mod peer;
mod placement;
mod poses;
mod session;
mod view_queue;
mod view_request;
mod window;

pub use error::ClientError;
pub use frames::Frames;
pub use live_view::{EncodedLiveView, LiveView};
pub use placement::ClientId;
pub use session::{Client, Session};
pub use view_queue::{Message, ViewQueue};
pub use view_request::{EncodedFrame, Frame, LiveFrame, PictureQuality, ViewRequest};
