//! Progress bars, on terminals only.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `length` steps.
#[must_use]
pub fn bar(what: impl Into<String>, length: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:44} {bar:24} {pos}/{len} {elapsed}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(length as u64).with_style(style).with_message(what.into());
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
