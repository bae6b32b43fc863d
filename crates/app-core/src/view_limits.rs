//! The limits of a node's views on the command line.

use clap::Args;
use node::NodeConfig;

use crate::sizes::within;

/// The limits of a node's views.
#[derive(Debug, Clone, Copy, Args)]
pub struct ViewLimitArgs {
    /// The share of the time that views of the method direct may take while others are served
    #[arg(long, value_name = "SHARE", default_value_t = 0.1, value_parser = within(0.01..=1.0))]
    direct_share: f64,
    /// The most seconds of one view; a view that is predicted to take longer is refused
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0, value_parser = within(0.001..=86_400.0))]
    max_view_s: f64,
}

impl ViewLimitArgs {
    /// A configuration with these limits.
    #[must_use]
    pub fn within(self, config: NodeConfig) -> NodeConfig {
        NodeConfig { direct_share: self.direct_share, max_view_s: self.max_view_s, ..config }
    }
}
