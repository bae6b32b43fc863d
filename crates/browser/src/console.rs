//! Messages of a page's console.

use thirtyfour::BrowserLogEntry;

/// One message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConsoleEntry {
    /// The level that the driver states: `SEVERE`, `WARNING`, `INFO`, `DEBUG`.
    pub level: String,
    /// Where it is from: `console-api`, `javascript`, `network`, `security`.
    pub source: String,
    /// The place in the sources, and the text.
    pub message: String,
}

impl From<BrowserLogEntry> for ConsoleEntry {
    fn from(entry: BrowserLogEntry) -> Self {
        Self { level: entry.level, source: entry.source.unwrap_or_default(), message: entry.message }
    }
}

impl ConsoleEntry {
    /// Whether it is an error: of a script, a policy, or a file that is missing.
    #[must_use]
    pub fn is_error(&self) -> bool {
        self.level == "SEVERE"
    }

    /// Whether it is about a connection, which a test may have cut.
    #[must_use]
    pub fn is_of_network(&self) -> bool {
        self.source == "network" || self.message.contains("WebSocket connection to")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(level: &str, source: &str, message: &str) -> ConsoleEntry {
        let [level, source, message] = [level, source, message].map(str::to_owned);
        ConsoleEntry { level, source, message }
    }

    #[test]
    fn a_lost_connection_is_told_from_a_fault_of_a_script() {
        let lost = entry("SEVERE", "javascript", "main.js 9:1 WebSocket connection to 'ws://…' failed: ");
        let missing = entry("SEVERE", "network", "http://…/none.js - Failed to load resource");
        let fault = entry("SEVERE", "javascript", "main.js 9:1 Uncaught TypeError: null is no object");
        assert!([&lost, &missing, &fault].iter().all(|entry| entry.is_error()));
        assert!(lost.is_of_network() && missing.is_of_network() && !fault.is_of_network());
        assert!(!entry("INFO", "console-api", "hello").is_error());
    }
}
