//! `myriorama replay`: the schedule's commands for recorded events.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use app_core::print_line;
use clap::Args;
use coordinator::schedule::{Command, LogError, ProbeKind, Step, replay};

/// Replays the events that `myriorama coordinator --record` wrote, and prints the schedule's commands, each with the
/// time since the coordinator's start. The same events give the same commands.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// A file that `--record` wrote
    #[arg(value_name = "LOG")]
    log: PathBuf,
}

/// Replays the log.
///
/// # Errors
/// The log cannot be read; the text names the line and the field.
pub fn run(args: &ReplayArgs) -> anyhow::Result<Outcome> {
    let file = File::open(&args.log).with_context(|| format!("cannot read {}", args.log.display()))?;
    let steps = replay(BufReader::new(file)).map_err(|error| wrong(args, error))?;
    let events = steps.len();
    // Liveness probes of all nodes come every few seconds.
    let is_routine =
        |command: &Command| matches!(command, Command::Probe(probe) if probe.kind() == ProbeKind::Liveness);
    for Step { now, commands, .. } in steps {
        for command in commands.iter().filter(|command| !is_routine(command)) {
            print_line!("{:>10.3} s  {command}", now.as_secs_f64());
        }
    }
    eprintln!("{events} events");
    Ok(Outcome::Done)
}

fn wrong(args: &ReplayArgs, error: LogError) -> anyhow::Error {
    let text = format!("{}: {error}", args.log.display());
    match error {
        LogError::Read { .. } => anyhow::anyhow!(text),
        _ => BadInput(text).into(),
    }
}
