//! What the program's exit status says.

use std::process::ExitCode;

use crate::cameras::CameraFileError;

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything was done.
    Done,
    /// Done, but a check that was asked for fell short: by `--strict`, `--least-psnr` or `--longest-gap`.
    FellShort,
}

/// Something that the user gave cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BadInput(pub String);

/// 0 done, 1 a check that was asked for fell short, 2 input that cannot be used, 3 a failure at run time.
#[must_use]
pub fn code_of(result: &anyhow::Result<Outcome>) -> u8 {
    match result {
        Ok(Outcome::Done) => 0,
        Ok(Outcome::FellShort) => 1,
        Err(error) if error.chain().any(is_bad_input) => 2,
        Err(_) => 3,
    }
}

fn is_bad_input(error: &(dyn std::error::Error + 'static)) -> bool {
    let refused = matches!(error.downcast_ref(), Some(client::ClientError::Invalid { .. }));
    let not_loopback = matches!(error.downcast_ref(), Some(node::ServeError::NotLoopback { .. }));
    let rig = error.is::<sampling::RigError>();
    refused
        || not_loopback
        || rig
        || error.is::<BadInput>()
        || error.is::<scene::SceneError>()
        || error.is::<CameraFileError>()
}

/// Says what went wrong, on standard error, and gives the exit status.
#[must_use]
pub fn report(result: &anyhow::Result<Outcome>) -> ExitCode {
    if let Err(error) = result {
        eprintln!("myriorama: {error:#}");
    }
    code_of(result).into()
}
