//! Errors of a browser.

use std::time::Duration;

use thirtyfour::error::WebDriverError;

/// Why a browser does not do what it was told.
#[derive(Debug, thiserror::Error)]
pub enum BrowserError {
    /// The program is not on this machine.
    #[error("{0} is missing: scripts/ensure-browser.sh installs it, or says how")]
    Missing(&'static str),
    /// The driver has not said its port.
    #[error("chromedriver does not start: {0}")]
    Driver(String),
    /// The driver has ended before it said its port.
    #[error("chromedriver does not start: it has ended")]
    Ended,
    /// A folder or a process cannot be made.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The driver or the page refuses a command.
    #[error("{command}: {source}")]
    Command {
        /// What the browser was told.
        command: String,
        /// Its answer.
        source: Box<WebDriverError>,
    },
    /// A page answers something else than what is expected.
    #[error("{command}: {answer}: {reason}")]
    Answer {
        /// What the browser was told.
        command: String,
        /// Its answer.
        answer: String,
        /// Why the answer cannot be read.
        reason: String,
    },
    /// A condition has not come true.
    #[error("{condition} has not come true within {within:?}")]
    Late {
        /// The condition, as a script.
        condition: String,
        /// The time that was allowed.
        within: Duration,
    },
}

impl BrowserError {
    pub(crate) fn command(command: &str, source: WebDriverError) -> Self {
        Self::Command { command: command.to_owned(), source: Box::new(source) }
    }

    pub(crate) fn answer(command: &str, answer: impl ToString, reason: impl ToString) -> Self {
        Self::Answer { command: command.to_owned(), answer: answer.to_string(), reason: reason.to_string() }
    }
}
