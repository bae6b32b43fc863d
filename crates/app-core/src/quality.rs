//! `--quality`: the quality of views whose light is shared.

use clap::Args;
use depth_image::LightCacheQuality;
use reconstruction::ReconstructionMethod;

/// A quality in place of a method.
#[derive(Debug, Clone, Copy, Args)]
pub struct QualityArgs {
    /// The quality of shared light, short for --method light_cache:NAME: draft, fast, balanced, fine or exact
    #[arg(long, value_name = "NAME", conflicts_with = "method", value_parser = quality)]
    quality: Option<LightCacheQuality>,
}

impl QualityArgs {
    /// The method of the quality; `None` without one.
    #[must_use]
    pub fn method(&self) -> Option<ReconstructionMethod> {
        self.quality.map(ReconstructionMethod::from)
    }
}

/// A quality by its name.
///
/// # Errors
/// For another text.
pub fn quality(text: &str) -> Result<LightCacheQuality, String> {
    LightCacheQuality::named(text)
        .ok_or_else(|| format!("expected one of {}", LightCacheQuality::ALL.map(LightCacheQuality::name).join(", ")))
}
