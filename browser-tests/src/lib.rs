//! The gateway's page in a real browser, on a cluster of a scalar engine.
//!
//! A [`visit`] is a page in a browser of its own, which must end without an error on its console. Its camera is compared with
//! closed forms ([`walk`]), its canvas with the picture of the Rust client. Pages are also served under a path ([`prefix`]).

pub mod prefix;
pub mod visit;
pub mod walk;
