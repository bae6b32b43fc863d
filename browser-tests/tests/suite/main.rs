//! The gateway's page in a real browser: exact pictures, input, overlays, faults, slow links.
#![allow(clippy::unwrap_used)]

mod addresses;
mod comparing;
mod faults;
mod frusta;
mod keyboard;
mod links;
mod measuring;
mod memory;
mod overlays;
mod pictures;
mod pivot;
mod playback;
mod refining;
mod running_cluster;
mod scene;
mod status;
mod surface;
mod tokens;
mod views;
mod walking;
