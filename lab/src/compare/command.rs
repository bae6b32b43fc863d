//! `myriorama-lab study compare`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use app_core::exit::{BadInput, Outcome};
use clap::Args;
use report::{Cell, Table};

use super::bd_time::bd_time;
use super::fronts::{ALL, Methods, read};
use crate::statistics::geometric_mean;

/// Compares the fronts of two reports by BD-time: the mean ratio of costs at equal FLIP of the foreground.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  myriorama-lab study planner --quick --out old       of one version of the program, and likewise `new` of another
  myriorama-lab study compare old/report.json new/report.json")]
pub struct CompareArgs {
    /// The report of `study planner` to compare with
    #[arg(value_name = "OLD")]
    old: PathBuf,
    /// The report that is compared
    #[arg(value_name = "NEW")]
    new: PathBuf,
}

/// Prints the differences.
///
/// # Errors
/// A report cannot be read or is no report of fronts, or both have no subject in common.
pub fn run(args: &CompareArgs) -> anyhow::Result<Outcome> {
    let old = read(&args.old)?;
    let new = read(&args.new)?;
    if old.keys().all(|subject| !new.contains_key(subject)) {
        return Err(BadInput("the reports have no subject in common".to_owned()).into());
    }
    println!("{}", text(&old, &new)?);
    Ok(Outcome::of(true))
}

fn text(old: &BTreeMap<String, Methods>, new: &BTreeMap<String, Methods>) -> anyhow::Result<String> {
    let columns = [("subject", ""), ("reconstruction", ""), ("BD-time", "%")];
    let mut table = Table::new("BD-time, below 0 where the new report costs less", &columns);
    let mut ratios = Vec::new();
    for (subject, methods) in old {
        let Some(others) = new.get(subject) else { continue };
        for (method, points) in methods {
            let Some(other) = others.get(method) else { continue };
            let ratio = bd_time(points, other);
            ratios.extend(ratio.filter(|_| method == ALL).map(|ratio| 1.0 + ratio));
            let shown =
                ratio.map_or(Cell::from("not comparable"), |ratio| Cell::from(format!("{:+.1}", 100.0 * ratio)));
            table.push([subject.clone().into(), method.clone().into(), shown])?;
        }
    }
    let mut lines = vec![table.to_text()];
    if let Some(mean) = geometric_mean(&ratios) {
        let percent = 100.0 * (mean - 1.0);
        lines.push(format!("all methods, geometric mean of {} subjects: {percent:+.1} %", ratios.len()));
    }
    lines.extend(alone(old, new).map(|subject| format!("only in the old report: {subject}")));
    lines.extend(alone(new, old).map(|subject| format!("only in the new report: {subject}")));
    Ok(lines.join("\n"))
}

fn alone<'a>(
    one: &'a BTreeMap<String, Methods>,
    other: &'a BTreeMap<String, Methods>,
) -> impl Iterator<Item = &'a String> {
    one.keys().filter(|subject| !other.contains_key(*subject))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(subjects: &[(&str, f64)]) -> BTreeMap<String, Methods> {
        let methods = |scale: f64| {
            let points = vec![(scale, 0.2).into(), (2.0 * scale, 0.1).into()];
            Methods::from([(ALL.to_owned(), points.clone()), ("mesh".to_owned(), points)])
        };
        subjects.iter().map(|(name, scale)| ((*name).to_owned(), methods(*scale))).collect()
    }

    #[test]
    fn subjects_and_methods_are_listed_with_their_mean() {
        let old = report(&[("a", 1.0), ("b", 1.0), ("gone", 1.0)]);
        let new = report(&[("a", 2.0), ("b", 0.5), ("came", 1.0)]);
        let text = text(&old, &new).unwrap();
        assert_eq!(text.matches("+100.0").count(), 2, "{text}");
        assert_eq!(text.matches("-50.0").count(), 2, "{text}");
        assert!(text.contains("geometric mean of 2 subjects: +0.0 %"), "{text}");
        assert!(text.contains("old report: gone") && text.contains("new report: came"), "{text}");
    }

    #[test]
    fn fronts_without_a_common_error_are_named() {
        let old = report(&[("a", 1.0)]);
        let mut new = report(&[("a", 1.0)]);
        new.get_mut("a").unwrap().insert("mesh".to_owned(), vec![(1.0, 0.5).into()]);
        assert!(text(&old, &new).unwrap().contains("not comparable"));
    }
}
