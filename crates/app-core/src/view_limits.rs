//! The limits of a node's views on the command line.

use clap::Args;
use node::NodeConfig;

/// The limits of a node's views.
#[derive(Debug, Clone, Copy, Args)]
pub struct ViewLimitArgs {
    /// The share of the time that views of the method direct may take while others are served
    #[arg(long, value_name = "SHARE", default_value_t = 0.1, value_parser = share)]
    direct_share: f64,
    /// The most seconds of one view; a view that is predicted to take longer is refused
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0, value_parser = seconds)]
    max_view_s: f64,
}

impl ViewLimitArgs {
    /// A configuration with these limits.
    #[must_use]
    pub fn within(self, config: NodeConfig) -> NodeConfig {
        NodeConfig { direct_share: self.direct_share, max_view_s: self.max_view_s, ..config }
    }
}

fn share(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|share| (0.01..=1.0).contains(share)).ok_or_else(|| "expected 0.01 to 1".to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.001..=86_400.0).contains(seconds));
    seconds.ok_or_else(|| "expected 0.001 to 86400 seconds".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_that_would_refuse_everything_are_refused() {
        for text in ["0", "-1", "NaN", "inf", "a day", ""] {
            assert!(share(text).is_err() && seconds(text).is_err(), "{text}");
        }
        assert_eq!((share("0.5"), seconds("0.5"), seconds("600")), (Ok(0.5), Ok(0.5), Ok(600.0)));
    }
}
