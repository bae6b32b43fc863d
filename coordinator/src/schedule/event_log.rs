//! What happened to a schedule, kept as text: one JSON line an event, after a first line with the version. Run through
//! a scheduler again it gives the same commands.

use std::io::{self, BufRead, Read as _, Write};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::command::Command;
use super::event::Event;
use super::event_record::{EventRecord, WrongField};
use super::scheduler::Scheduler;

/// What the first line says.
const VERSION: u32 = 3;
/// A line that is longer is no event.
const MAX_LINE_BYTES: u64 = 1 << 20;

/// Why a log cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The reader failed.
    #[error("line {line} cannot be read: {source}")]
    Read {
        /// From 1.
        line: usize,
        /// Why.
        source: io::Error,
    },
    /// Longer than any event.
    #[error("line {line} has more than {MAX_LINE_BYTES} bytes")]
    TooLong {
        /// From 1.
        line: usize,
    },
    /// No JSON, or a field is missing, unknown or of another type.
    #[error("line {line}: {source}")]
    Json {
        /// From 1.
        line: usize,
        /// Names the field.
        source: serde_json::Error,
    },
    /// Of a program that writes another form.
    #[error("line 1: version is {found}, must be {VERSION}")]
    Version {
        /// Given.
        found: u32,
    },
    /// A field with a value that no event has.
    #[error("line {line}: {field} {reason}")]
    Field {
        /// From 1.
        line: usize,
        /// Which.
        field: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

/// Writes a log.
#[derive(Debug)]
pub struct Recorder<W> {
    writer: W,
}

impl<W: Write> Recorder<W> {
    /// Begins a log with its version.
    ///
    /// # Errors
    /// Where the writer fails.
    pub fn new(mut writer: W) -> io::Result<Self> {
        write_line(&mut writer, &Header { version: VERSION })?;
        Ok(Self { writer })
    }

    /// Adds what is given to [`Scheduler::step`].
    ///
    /// # Errors
    /// Where the writer fails.
    pub fn record(&mut self, now: Duration, event: &Event) -> io::Result<()> {
        let now_ns = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
        write_line(&mut self.writer, &Line { now_ns, event: event.into() })
    }
}

/// Whole lines are passed on, so that a log that breaks off does so between two of them.
fn write_line(writer: &mut impl Write, line: &impl Serialize) -> io::Result<()> {
    let mut text = serde_json::to_vec(line)?;
    text.push(b'\n');
    writer.write_all(&text)?;
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
    let Header { version } = parse(&first, 1)?;
    if version != VERSION {
        return Err(LogError::Version { found: version });
    }
    let (mut scheduler, mut steps) = (Scheduler::default(), Vec::new());
    while let Some(text) = next_line(&mut reader, steps.len() + 2)? {
        let line = steps.len() + 2;
        let Line { now_ns, event } = parse(&text, line)?;
        let (now, event) = (Duration::from_nanos(now_ns), event.read().map_err(|wrong| wrong_at(wrong, line))?);
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

fn wrong_at(wrong: WrongField, line: usize) -> LogError {
    LogError::Field { line, field: wrong.field, reason: wrong.reason }
}

fn parse<'t, T: Deserialize<'t>>(text: &'t [u8], line: usize) -> Result<T, LogError> {
    serde_json::from_slice(text).map_err(|source| LogError::Json { line, source })
}

#[derive(Serialize, Deserialize)]
struct Header {
    version: u32,
}

#[derive(Serialize, Deserialize)]
struct Line {
    /// Since the coordinator started.
    now_ns: u64,
    #[serde(flatten)]
    event: EventRecord,
}

#[cfg(test)]
#[path = "event_log_tests.rs"]
mod tests;
