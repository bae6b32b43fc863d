//! The way of browsers into a cluster: a page, a WebSocket for each visitor, and views over plain HTTP.
//!
//! `server` answers connections and `http` their requests. A `visitor` has two live streams, one of pictures in
//! motion and one of stills; `rate` chooses the size and the light of the pictures in motion, `still` the steps of stills. `scenes` keeps one session for all visitors of
//! a scene. Messages are in `protocol`, and on a page of the documentation: `docs/viewer-protocol.md`.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod assets;
mod camera;
mod compare;
mod config;
mod gateway;
mod http;
mod kept_session;
mod origin;
mod page;
mod parts;
mod picture_stream;
mod protocol;
mod rate;
mod responses;
mod scenes;
mod server;
mod status;
mod still;
mod tls;
mod token;
mod views;
mod visitor;
mod visits;

pub use config::{GatewayConfig, RequestOf, SharedLightMethods};
pub use server::{Connections, accept, serve};
pub use tls::{TlsError, tls_config};
pub use token::Token;
