//! Myriorama: the one program.

use std::env;
use std::os::unix::process::CommandExt as _;
use std::process::{Command, ExitCode};

use app_core::exit;
use clap::Parser as _;
use myriorama::cli::Cli;

/// The switch of Mesa's device selection, which looks for a Wayland display and warns where there is none.
const NO_DEVICE_SELECTION: &str = "NODEVICE_SELECT";

fn main() -> ExitCode {
    if env::var_os("XDG_RUNTIME_DIR").is_none() && env::var_os(NO_DEVICE_SELECTION).is_none() {
        start_again_without_device_selection();
    }
    node::init_logging("warn");
    exit::report(&Cli::parse().command.run())
}

/// Starts the program anew in this process, with the driver's switch set. Comes back only where the system refuses.
fn start_again_without_device_selection() {
    let Ok(program) = env::current_exe() else { return };
    let mut arguments = env::args_os();
    let name = arguments.next().unwrap_or_else(|| program.clone().into());
    // An error leaves the warnings, and the program goes on.
    let _ = Command::new(program).arg0(name).args(arguments).env(NO_DEVICE_SELECTION, "1").exec();
}
