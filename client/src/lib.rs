//! Thin client library: request views, receive frames. Links no wgpu.
//!
//! A [`Client`] knows the coordinator; a [`Session`] has a plan and talks to the compositors alone. [`Frames`] are those of
//! one request, whose `window` is drawn from any number of views. `delivery` requests them from all compositors, through a
//! `request_pump` for each: [`WorkStealing`] shares the views out, and [`FlowControl`] keeps a fast compositor busy. A
//! [`LiveView`] is a camera that moves.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod active_plan;
mod delivery;
mod error;
mod flow_control;
mod frames;
mod live_stream;
mod live_view;
mod peer;
mod placement;
mod poses;
mod request_pump;
mod session;
mod unrequested;
mod view_request;
mod window;
mod work_stealing;

pub use error::ClientError;
pub use flow_control::FlowControl;
pub use frames::Frames;
pub use live_view::{EncodedLiveView, LiveView};
pub use placement::ClientId;
pub use session::{Client, Session};
pub use view_request::{EncodedFrame, Frame, LiveFrame, LiveTimes, PictureQuality, ViewRequest};
pub use work_stealing::WorkStealing;
