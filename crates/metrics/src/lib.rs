//! Image, depth and visibility error.
//!
//! All numbers of charts and checks are made here, from views with 8-bit sRGB and planes of inverse depth. Each image
//! metric gives a map first and a mean second, so that it can be split by [`PixelClass`].
//!
//! | metric | what it is | agrees with |
//! |---|---|---|
//! | [`psnr_db`] | 8-bit sRGB, all three channels | closed form |
//! | [`ssim_map`] | 7×7 uniform window, mean over channels | scikit-image's default |
//! | [`flip_map`] | LDR-FLIP at 67.02 pixels per degree | NVIDIA's `flip-evaluator` |
//! | [`pdiff_map`] | Yee's perceptual difference | the public tool's counts, within about 5 % |
//! | [`depth_errors`] | relative planar depth, wrong hits | closed form |
//!
//! An empty selection has no mean: it is `None`, never NaN.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod change_error;
mod classes;
mod color;
mod convolution;
mod depth_error;
mod error;
mod flip;
mod foreground;
mod image;
mod pdiff;
mod psnr;
mod score_map;
mod ssim;
mod steps;

pub use change_error::change_error_map;
pub use classes::{PixelClass, classify, unheld_rate};
pub use depth_error::{DepthErrors, WRONG_HIT_RELATIVE, depth_errors};
pub use error::MetricsError;
pub use flip::{FLIP_REACH_PX, flip_map};
pub use foreground::{PictureErrors, foreground};
pub use pdiff::pdiff_map;
pub use psnr::{PSNR_CAP_DB, psnr_db};
pub use score_map::ScoreMap;
pub use ssim::{SSIM_WINDOW_PX, ssim_map};
pub use steps::{STEP_RELATIVE, step_pixels};
