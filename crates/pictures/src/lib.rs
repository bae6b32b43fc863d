//! Views as pictures: colour, depth, provenance and errors in false colours; lines of text in them; and cameras as a
//! `transforms.json` names them.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod camera_frame;
mod depth;
mod error_map;
mod provenance;
mod text;

use depth_image::View;
use image::RgbImage;

pub use camera_frame::camera_frame;
pub use depth::{Grey16, depth, inverse_depth_16};
pub use error_map::error_map;
pub use provenance::{Legend, provenance};
pub use text::TextStyle;

/// The colour of a view; `None` where its plane is not of its size.
#[must_use]
pub fn rgb(view: &View) -> Option<RgbImage> {
    RgbImage::from_raw(view.size_px.x, view.size_px.y, view.srgb8.clone())
}
