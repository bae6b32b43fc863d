//! Myriorama: the one program.

use std::process::ExitCode;

use app_core::exit;
use clap::Parser as _;
use myriorama::cli::Cli;

fn main() -> ExitCode {
    node::init_logging("warn");
    exit::report("myriorama", &Cli::parse().command.run())
}
