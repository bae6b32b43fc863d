//! The exit status of the program.

use std::process::ExitCode;

use crate::camera_file::CameraFileError;

/// The end of a command that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything was done.
    Done,
    /// All was done, but a check fell short.
    FellShort,
    /// A signal ended the command, which says how to go on.
    Interrupted,
}

impl Outcome {
    /// The outcome of a check.
    #[must_use]
    pub fn of(holds: bool) -> Self {
        if holds { Self::Done } else { Self::FellShort }
    }
}

/// As shells say of a program that ctrl-c ends: 128 and the number of the signal.
const INTERRUPTED: u8 = 130;

/// Input that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BadInput(pub String);

fn is_bad_input(error: &(dyn std::error::Error + 'static)) -> bool {
    matches!(error.downcast_ref(), Some(client::ClientError::Invalid { .. }))
        || matches!(error.downcast_ref(), Some(node::ServeError::NotLoopback { .. }))
        || error.is::<sampling::RigError>()
        || error.is::<BadInput>()
        || error.is::<scene::SceneError>()
        || error.is::<CameraFileError>()
}

/// Prints the error of `program` on standard error, and returns the exit status: 0 done, 1 a check fell short, 2 input that cannot be
/// used, 3 a failure at run time, 130 ended by a signal.
#[must_use]
pub fn report(program: &str, result: &anyhow::Result<Outcome>) -> ExitCode {
    if let Err(error) = result {
        eprintln!("{program}: {error:#}");
    }
    status(result).into()
}

/// The exit status of a result.
#[must_use]
pub fn status(result: &anyhow::Result<Outcome>) -> u8 {
    match result {
        Ok(Outcome::Done) => 0,
        Ok(Outcome::FellShort) => 1,
        Ok(Outcome::Interrupted) => INTERRUPTED,
        Err(error) if error.chain().any(is_bad_input) => 2,
        Err(_) => 3,
    }
}
