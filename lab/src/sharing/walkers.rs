//! Viewers that walk from cell to cell, on the scalar engine: a program of the tests measures them, if it is there.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::Context as _;
use report::{Bar, Cell, Check, Table};

use crate::section::Section;

/// The program, in the folder of this one.
const PROGRAM: &str = "walkers";
const ABSENT: &str = "the program is absent: cargo build --release -p cluster-tests --bin walkers";
/// Figures that the program prints, each with its unit and bar.
const FIGURES: [(&str, &str, Bar); 3] = [
    ("plans a second", "1/s", Bar::AtMost(1.0)),
    ("wanted fetches ended", "", Bar::AtMost(0.0)),
    ("longest gap", "s", Bar::AtMost(0.5)),
];

/// Runs the program, if it is there.
///
/// # Errors
/// It fails, or prints other figures.
pub(super) async fn measure() -> anyhow::Result<Section> {
    let Some(program) = program() else {
        let check = |(name, unit, bar)| Check::not_run(format!("walkers: {name}"), unit, bar, ABSENT);
        return Ok(Section { checks: FIGURES.map(check).into(), ..Section::default() });
    };
    let walked = tokio::task::spawn_blocking(|| Command::new(program).stderr(Stdio::inherit()).output()).await?;
    let output = walked.context("cannot start the walkers")?;
    anyhow::ensure!(output.status.success(), "the walkers ended with {}", output.status);
    section(&String::from_utf8(output.stdout)?)
}

fn program() -> Option<PathBuf> {
    Some(std::env::current_exe().ok()?.with_file_name(PROGRAM)).filter(|program| program.is_file())
}

/// A line of the output is `figure: value`.
fn section(output: &str) -> anyhow::Result<Section> {
    let value_of = |name: &str| output.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
    let columns = [("figure", ""), ("policy", ""), ("value", "")];
    let mut table = Table::new("16 walkers, a new cell every 2 s each (scalar engine, 4 nodes)", &columns);
    let (mut checks, policy) = (Vec::new(), value_of("policy").unwrap_or_default());
    for (name, unit, bar) in FIGURES {
        let value: f64 =
            value_of(name).and_then(|value| value.parse().ok()).context("the walkers print other figures")?;
        let name_and_unit = if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") };
        table.push([Cell::from(name_and_unit), policy.into(), value.into()])?;
        checks.push(Check::new(format!("walkers: {name}"), value, unit, bar));
    }
    Ok(Section { device: String::new(), tables: vec![table], checks })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_read_by_name() {
        let section =
            section("policy: pipeline\nplans a second: 1.5\nwanted fetches ended: 0\nlongest gap: 0.2\n").unwrap();
        let holds: Vec<_> = section.checks.iter().map(Check::outcome).collect();
        assert_eq!(holds, [report::Outcome::FallsShort, report::Outcome::Holds, report::Outcome::Holds]);
        assert!(super::section("plans a second: 1.5\n").is_err());
    }
}
