//! `myriorama-lab`: measurements of the product, each as a report. Its commands are `bench` and `study`. `scene` writes a scene
//! as a file.
//!
//! [`mod@bench`] compares measured values with bars. [`lages`], [`sampling_study`] and [`layered`] repeat the experiments of papers.
//! All studies are rows that are measured and reported by [`study`].
//! [`load`] and [`scaling`] start clusters of [`processes`]. [`failures`] holds the shapes of curves of errors.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod balance;
mod bench;
mod budgets;
mod command;
mod compare;
mod cpu_share;
mod delivery;
mod evaluation;
mod failures;
mod graph;
mod impostors;
mod lages;
mod layered;
mod lit;
mod load;
mod markdown;
mod memory;
mod models;
mod pareto;
mod process;
mod processes;
mod reference_views;
mod sampling_study;
mod scaling;
mod scene_file;
mod section;
mod shadows;
mod sharing;
mod stability;
mod statistics;
mod study;
#[cfg(test)]
mod tests;
mod viewer;

use std::process::ExitCode;

use app_core::exit;
use clap::{CommandFactory as _, FromArgMatches as _, Parser};
use command::LabCommand;

/// Measures how fast and how accurate Myriorama is, and how its methods fail.
#[derive(Debug, Parser)]
#[command(name = "myriorama-lab", version, propagate_version = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: LabCommand,
}

const EXAMPLES: &str = "\
Examples:
  myriorama-lab bench --quick                       speed and accuracy against bars: out/bench/index.html
  myriorama-lab bench viewer                        the viewer in a real browser
  myriorama-lab study failures --quick --strict     how methods fail, as curves with the shapes that they must have
  myriorama-lab scene bird-nest --out bird-nest.glb a scene of the studies as a file for the program

Parts that start coordinators and nodes as processes need the program myriorama in the same folder: `make lab` builds both.

Exit status: 0 done; 1 a check fell short and --strict was given; 2 arguments or input that cannot be used; 3 a failure at
run time. RUST_LOG=info (or debug) says what is going on.";

fn main() -> ExitCode {
    node::init_logging("warn");
    let cli = Cli::from_arg_matches(&taking_fixtures(Cli::command()).get_matches());
    exit::report("myriorama-lab", &cli.unwrap_or_else(|error| error.exit()).command.run())
}

/// Lets every option that takes a scene take a fixture, too.
fn taking_fixtures(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|arg| {
        let takes_scene = ["scene", "other_scene"].contains(&arg.get_id().as_str());
        if takes_scene { arg.value_parser(fixtures::spec) } else { arg }
    });
    command.mut_subcommands(taking_fixtures)
}

#[cfg(test)]
mod command_line_tests {
    use super::*;
    use crate::command::StudyCommand;

    fn parsed(arguments: &[&str]) -> Result<Cli, clap::Error> {
        let matches = taking_fixtures(Cli::command()).try_get_matches_from([&["myriorama-lab"], arguments].concat())?;
        Cli::from_arg_matches(&matches)
    }

    #[test]
    fn input_that_cannot_be_used_is_named_with_status_2() {
        let cases: [(&[&str], &str); 3] = [
            (&["study", "fronts", "--subject", "nowhere"], "nowhere"),
            (&["study", "light_cache", "--subject", "nowhere"], "nowhere"),
            (&["study", "light_cache", "--subject", "helmet", "--models", "/nowhere/models"], "/nowhere/models"),
        ];
        for (arguments, named) in cases {
            let result = parsed(arguments).unwrap().command.run();
            assert_eq!(exit::status(&result), 2, "{arguments:?}");
            let message = format!("{:#}", result.unwrap_err());
            assert!(message.contains(named), "{arguments:?}: {message}");
        }
        let refused = parsed(&["bench", "scaling", "--quota", "0"]).unwrap_err();
        assert!(refused.exit_code() == 2 && refused.to_string().contains("0.01 to 64"), "{refused}");
        let refused = parsed(&["study", "light_cache", "--views", "9"]).unwrap_err();
        assert!(refused.exit_code() == 2 && refused.to_string().contains("1..=8"), "{refused}");
    }

    #[test]
    fn a_quick_study_of_light_cache_has_fewer_views_unless_their_number_is_given() {
        let views = |options: &[&str]| {
            let LabCommand::Study(study) = parsed(&[&["study", "light_cache"], options].concat()).unwrap().command
            else {
                panic!("a study");
            };
            let StudyCommand::LightCache(args) = *study else { panic!("light_cache") };
            args.views
        };
        assert_eq!([views(&[]), views(&["--quick"]), views(&["--quick", "--views", "1"])], [8, 2, 1]);
    }

    #[test]
    fn every_command_has_help() {
        Cli::command().debug_assert();
        for command in [&["bench", "--help"][..], &["bench", "scaling", "--help"], &["study", "lages", "--help"]] {
            let help = parsed(command).unwrap_err();
            assert_eq!(help.exit_code(), 0, "{command:?}");
        }
    }
}
