//! Errors of a browser.

use std::time::Duration;

/// Why a browser does not do what it was told.
#[derive(Debug, thiserror::Error)]
pub enum BrowserError {
    /// The program is not on this machine.
    #[error("{0} is missing: scripts/ensure-browser.sh installs it, or says how")]
    Missing(&'static str),
    /// The browser opens no port for the DevTools protocol.
    #[error("chromium does not start: {0}")]
    Start(String),
    /// A folder or a process cannot be made.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The browser has ended, its page has crashed, or the connection is lost.
    #[error("{command}: chromium or its page has ended")]
    Ended {
        /// What the browser was told.
        command: String,
    },
    /// The browser refuses a command.
    #[error("{command}: {reason}")]
    Refused {
        /// What the browser was told.
        command: String,
        /// Its reason.
        reason: String,
    },
    /// A script throws an exception.
    #[error("{script}: {exception}")]
    Thrown {
        /// The script.
        script: String,
        /// The text of the exception.
        exception: String,
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
    /// The browser does not answer in time.
    #[error("{command}: no answer within {within:?}")]
    NoAnswer {
        /// What the browser was told.
        command: String,
        /// The time that was allowed.
        within: Duration,
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
    pub(crate) fn ended(command: &str) -> Self {
        Self::Ended { command: command.to_owned() }
    }

    pub(crate) fn refused(command: &str, reason: &str) -> Self {
        Self::Refused { command: command.to_owned(), reason: reason.to_owned() }
    }

    pub(crate) fn answer(command: &str, answer: impl ToString, reason: impl ToString) -> Self {
        Self::Answer { command: command.to_owned(), answer: answer.to_string(), reason: reason.to_string() }
    }

    pub(crate) fn no_answer(command: &str, within: Duration) -> Self {
        Self::NoAnswer { command: command.to_owned(), within }
    }
}
