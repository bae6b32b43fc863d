//! Myriorama: the one program.

use std::process::ExitCode;

use app_core::{exit, process};
use clap::Parser as _;
use myriorama::cli::Cli;

fn main() -> ExitCode {
    process::restart_with_library_settings();
    node::init_logging("warn");
    exit::report("myriorama", &Cli::parse().command.run())
}
