//! Myriorama: the one program.

use std::env;
use std::os::unix::process::CommandExt as _;
use std::process::{Command, ExitCode};
use std::thread;

use app_core::exit;
use clap::Parser as _;
use myriorama::cli::Cli;

fn main() -> ExitCode {
    let missing = missing_settings();
    if !missing.is_empty() {
        start_again_with(&missing);
    }
    node::init_logging("warn");
    exit::report(&Cli::parse().command.run())
}

/// Settings of libraries, which read them from the environment before this program runs. What the user has set stays.
fn missing_settings() -> Vec<(&'static str, String)> {
    // By default glibc has eight arenas a core. Each keeps freed memory that its next large buffers do not fit.
    let arenas = thread::available_parallelism().map_or(1, usize::from).to_string();
    let mut settings = vec![("MALLOC_ARENA_MAX", arenas)];
    if env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Mesa's device selection looks for a Wayland display, and warns where there is none.
        settings.push(("NODEVICE_SELECT", "1".to_owned()));
    }
    settings.retain(|(name, _)| env::var_os(name).is_none());
    settings
}

/// Starts the program anew in this process, with more variables. Comes back only where the system refuses.
fn start_again_with(variables: &[(&str, String)]) {
    let Ok(program) = env::current_exe() else { return };
    let mut arguments = env::args_os();
    let name = arguments.next().unwrap_or_else(|| program.clone().into());
    // After an error the program goes on, with the libraries' own settings.
    let _ = Command::new(program).arg0(name).args(arguments).envs(variables.iter().map(|(k, v)| (k, v))).exec();
}
