//! The errors that a budget may limit, by their names.

use depth_image::{NamedMethod, named_methods};

/// An error of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// FLIP over the foreground.
    Flip,
    /// FLIP over all pixels.
    FlipWhole,
    /// The mean squared error over the foreground, as PSNR.
    Psnr,
    /// The share of the foreground that no sample camera sees.
    Disocclusion,
}

/// All metrics; the first is the default.
const METHODS: [NamedMethod<Metric>; 4] = [
    row("flip", Metric::Flip, "FLIP over the foreground, at most 1"),
    row("flip whole", Metric::FlipWhole, "FLIP over all pixels, at most 1"),
    row("psnr", Metric::Psnr, "the mean squared error over the foreground, in decibels"),
    row("disocclusion", Metric::Disocclusion, "the foreground that no sample camera sees, in per cent"),
];

named_methods!(Metric, UnknownMetric, "metric");

const fn row(name: &'static str, method: Metric, help: &'static str) -> NamedMethod<Metric> {
    NamedMethod { name, method, setting: None, help }
}

impl Metric {
    /// Metrics have no settings.
    fn setting(self) -> Option<&'static str> {
        None
    }
}
