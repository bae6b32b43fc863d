//! What commands share: cameras in files, and the default picture of a model.
#![allow(clippy::unwrap_used)]

mod camera_file;
mod default_frame;
