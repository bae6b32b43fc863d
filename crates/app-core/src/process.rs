//! Basics of every command: a runtime and signals.

use anyhow::Context as _;
use tokio::runtime::Runtime;
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

/// A runtime for services and clients.
///
/// # Errors
/// The system refuses threads.
pub fn runtime() -> anyhow::Result<Runtime> {
    tokio::runtime::Builder::new_multi_thread().enable_all().build().context("no runtime")
}

/// Ctrl-c or SIGTERM, once and again.
#[derive(Debug, Clone, Default)]
pub struct StopSignals {
    /// The first asks the command to end in order.
    pub first: CancellationToken,
    /// The second ends the command at once.
    pub second: CancellationToken,
}

impl StopSignals {
    /// Signals of the system from now on.
    ///
    /// # Errors
    /// Signals cannot be received.
    pub fn listen() -> anyhow::Result<Self> {
        let [mut interrupt, mut terminate] = [signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?];
        let signals = Self::default();
        let heard = signals.clone();
        tokio::spawn(async move {
            for token in [heard.first, heard.second] {
                tokio::select! {
                    _ = interrupt.recv() => token.cancel(),
                    _ = terminate.recv() => token.cancel(),
                }
            }
        });
        Ok(signals)
    }
}
