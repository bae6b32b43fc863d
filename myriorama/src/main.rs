//! Myriorama: the one program.

use std::process::ExitCode;

use clap::Parser as _;
use myriorama::{cli::Cli, exit};

fn main() -> ExitCode {
    node::init_logging("warn");
    let cli = Cli::parse();
    let result = cli.command.run();
    exit::report(&result)
}
