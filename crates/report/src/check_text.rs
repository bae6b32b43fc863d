//! Checks as a table, the end of a program's output.

use crate::{Check, Outcome};

/// An aligned table of name, value, bar and outcome, then one line of totals.
pub(crate) fn checks_text(checks: &[Check]) -> String {
    let header = ["check", "value", "bar", "outcome"].map(String::from);
    let rows: Vec<[String; 4]> = std::iter::once(header).chain(checks.iter().map(row)).collect();
    let widths: [usize; 4] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    let lines = rows.iter().map(|row| line(row, widths));
    lines.chain([totals(checks)]).collect::<Vec<_>>().join("\n")
}

fn row(check: &Check) -> [String; 4] {
    let outcome = match &check.reason {
        Some(reason) => format!("{}: {reason}", check.outcome().words()),
        None => check.outcome().words().into(),
    };
    [check.name.clone(), check.value_text(), check.bar_text(), outcome]
}

/// Names are aligned left, values right, the rest left.
fn line([name, value, bar, outcome]: &[String; 4], widths: [usize; 4]) -> String {
    format!("{name:<0$}  {value:>1$}  {bar:<2$}  {outcome}", widths[0], widths[1], widths[2])
}

fn totals(checks: &[Check]) -> String {
    let [holds, short, not_run] = [Outcome::Holds, Outcome::FallsShort, Outcome::NotRun]
        .map(|outcome| checks.iter().filter(|check| check.outcome() == outcome).count());
    format!("{} checks: {holds} hold, {short} fall short, {not_run} not run", checks.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Bar;

    #[test]
    fn the_table_is_aligned() {
        let checks = [
            Check::new("one view", 1.25, "ms", Bar::AtMost(2.0)),
            Check::new("disocclusion", 12.0, "%", Bar::AtMost(0.5)),
            Check::not_run("GPU speed-up", "×", Bar::AtLeast(10.0), "no GPU"),
        ];
        let expected = "\
check           value  bar      outcome
one view      1.25 ms  ≤ 2 ms   holds
disocclusion     12 %  ≤ 0.5 %  FALLS SHORT
GPU speed-up        –  ≥ 10 ×   not run: no GPU
3 checks: 1 hold, 1 fall short, 1 not run";
        assert_eq!(checks_text(&checks), expected);
    }
}
