//! The log of a schedule's events, one line of RON each, after a first line with the version. Replayed, it gives the same
//! commands. Floats keep every bit; events hold finite numbers only.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Read as _, Write};
use std::time::Duration;

use cluster::InvalidField;
use serde::{Deserialize, Serialize};

use super::{Command, Event, Scheduler};

/// Logs of other versions are refused.
const VERSION: u32 = 11;
const VERSION_KEY: &str = "version";
/// A line that is longer is no event.
const MAX_LINE_BYTES: u64 = 16 << 20;

/// Why a log cannot be replayed. Lines are counted from 1.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum LogError {
    /// The reader failed.
    #[error("line {line} cannot be read: {source}")]
    Read { line: usize, source: io::Error },
    /// Longer than any event.
    #[error("line {line} has more than {MAX_LINE_BYTES} bytes")]
    TooLong { line: usize },
    /// The line is no event: a field is missing, unknown or of another type.
    #[error("line {line}: {source}")]
    Malformed { line: usize, source: ron::error::SpannedError },
    /// The first line states no version.
    #[error("line 1: version is missing")]
    NoVersion,
    /// The log of another version of the program.
    #[error("line 1: version is {found}, must be {VERSION}")]
    Version { found: u32 },
    /// A field with a value that no event has.
    #[error("line {line}: {source}")]
    Field { line: usize, source: InvalidField },
}

/// Writes a log.
#[derive(Debug)]
pub struct Recorder<W>(W);

impl<W: Write> Recorder<W> {
    /// Begins a log with its version.
    ///
    /// # Errors
    /// Where the writer fails.
    pub fn new(mut writer: W) -> io::Result<Self> {
        write_line(&mut writer, &Header::from([(VERSION_KEY.to_owned(), VERSION)]))?;
        Ok(Self(writer))
    }

    /// Adds what is given to [`Scheduler::step`].
    ///
    /// # Errors
    /// Where the writer fails.
    pub fn record(&mut self, now: Duration, event: &Event) -> io::Result<()> {
        let now_ns = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
        write_line(&mut self.0, &EventRecord { now_ns, event })
    }
}

/// Whole lines are passed on, so that a log that breaks off does so between two of them.
fn write_line(writer: &mut impl Write, line: &impl Serialize) -> io::Result<()> {
    let text = ron::to_string(line).map_err(io::Error::other)?;
    writer.write_all(format!("{text}\n").as_bytes())?;
    writer.flush()
}

/// One event of a replayed log, and the commands that followed.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Step {
    pub now: Duration,
    pub event: Event,
    pub commands: Vec<Command>,
}

/// Runs a log through a new scheduler.
///
/// # Errors
/// At the first line that is no event.
pub fn replay(mut reader: impl BufRead) -> Result<Vec<Step>, LogError> {
    let first = next_line(&mut reader, 1)?.unwrap_or_default();
    let version = *parse::<Header>(&first, 1)?.get(VERSION_KEY).ok_or(LogError::NoVersion)?;
    if version != VERSION {
        return Err(LogError::Version { found: version });
    }
    let mut scheduler = Scheduler::default();
    let mut steps = Vec::new();
    while let Some(text) = next_line(&mut reader, steps.len() + 2)? {
        let line = steps.len() + 2;
        let EventRecord::<Event> { now_ns, event } = parse(&text, line)?;
        event.validate().map_err(|source| LogError::Field { line, source })?;
        let now = Duration::from_nanos(now_ns);
        let commands = scheduler.step(now, event.clone());
        steps.push(Step { now, event, commands });
    }
    Ok(steps)
}

/// `None` at the end.
fn next_line(reader: &mut impl BufRead, line: usize) -> Result<Option<Vec<u8>>, LogError> {
    let mut text = Vec::new();
    let read = reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut text);
    let count = read.map_err(|source| LogError::Read { line, source })?;
    if count as u64 == MAX_LINE_BYTES && !text.ends_with(b"\n") {
        return Err(LogError::TooLong { line });
    }
    Ok((count > 0).then_some(text))
}

fn parse<'t, T: Deserialize<'t>>(text: &'t [u8], line: usize) -> Result<T, LogError> {
    ron::de::from_bytes(text).map_err(|source| LogError::Malformed { line, source })
}

/// The first line: `{"version":5}`, as in all versions.
type Header = BTreeMap<String, u32>;

/// An event, and the time since the coordinator started.
#[derive(Serialize, Deserialize)]
struct EventRecord<E> {
    now_ns: u64,
    event: E,
}

#[cfg(test)]
#[path = "event_log_tests.rs"]
mod tests;
