//! Logs go to standard error; `RUST_LOG` filters them, and `MYRIORAMA_LOG_FORMAT=json` makes each a line of JSON.

use tracing_subscriber::EnvFilter;

/// Starts logging; `default_filter` applies where `RUST_LOG` is not set. A second call does nothing.
pub fn init_logging(default_filter: &str) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default_filter));
    let logging = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    let is_json = std::env::var("MYRIORAMA_LOG_FORMAT").is_ok_and(|format| format == "json");
    let started = if is_json { logging.json().try_init() } else { logging.try_init() };
    if started.is_err() {
        tracing::debug!("logging was already started");
    }
}
