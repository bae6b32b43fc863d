//! Logs go to standard error; `RUST_LOG` filters them.

use tracing_subscriber::EnvFilter;

/// Starts logging; `default_filter` holds where `RUST_LOG` says nothing. A second call does nothing.
pub fn init_logging(default_filter: &str) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default_filter));
    let started = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).try_init();
    if started.is_err() {
        tracing::debug!("logging was already started");
    }
}
