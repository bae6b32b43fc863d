//! The table of cases, and checks of regret, promises and planning time.

use planner::{ERROR_RATE, Statistic, is_over};
use report::{Bar, Cell, Check, Report, Table};

use super::case::Case;
use crate::statistics::{geometric_mean, median, quantile};

/// Errors vary little up to this.
const LOW_VARIATION: f64 = 0.3;

/// Adds the table and the checks.
///
/// # Errors
/// A row that does not fit the table.
pub fn add_to(report: &mut Report, cases: &[Case]) -> anyhow::Result<()> {
    report.tables.push(table(cases)?);
    report.checks.extend(regrets(cases));
    report.checks.extend(promises(cases));
    report.checks.extend(predictions(cases));
    report.checks.extend(times(cases));
    Ok(())
}

fn table(cases: &[Case]) -> anyhow::Result<Table> {
    let columns = [
        ("subject", ""),
        ("priced in soft light", ""),
        ("budget", ""),
        ("choice", ""),
        ("regret", ""),
        ("strict regret", ""),
        ("error over budget", ""),
        ("variation", ""),
        ("cost over default or direct", ""),
        ("nothing kept", ""),
        ("plan", "s"),
        ("of that measuring", "s"),
        ("the same plan again", "s"),
    ];
    let mut table = Table::new("Plans", &columns);
    for case in cases {
        table.push([
            Cell::from(case.subject.clone()),
            Cell::Flag(case.is_lit),
            case.budget.to_string().into(),
            case.choice.clone().into(),
            case.regret.into(),
            case.strict_regret.into(),
            case.over.into(),
            case.variation.into(),
            case.over_default.into(),
            Cell::Flag(case.is_first),
            case.plan_s.into(),
            case.spent_s.into(),
            case.again_s.into(),
        ])?;
    }
    Ok(table)
}

fn regrets(cases: &[Case]) -> Vec<Check> {
    let is_mean = |case: &&Case| case.budget.error().is_none_or(|term| term.statistic() == Statistic::Mean);
    let of_means = || cases.iter().filter(is_mean);
    let low: Vec<f64> =
        of_means().filter(|case| case.variation <= LOW_VARIATION).filter_map(|case| case.regret).collect();
    let all: Vec<f64> = of_means().filter_map(|case| case.regret).collect();
    let lit: Vec<f64> = cases.iter().filter(|case| case.is_lit).map(|case| case.over_default).collect();
    vec![
        share("regret at most 1.10, means and times of low variation", &low, 1.10, 0.70),
        share("regret at most 1.25, means and times", &all, 1.25, 0.75),
        value("regret, median", (!all.is_empty()).then(|| median(all.clone())), 1.05),
        value("regret, worst", all.iter().copied().reduce(f64::max), 2.0),
        value("cost over default or direct in soft light, geometric mean", geometric_mean(&lit), 0.8),
    ]
}

fn promises(cases: &[Case]) -> Vec<Check> {
    let with_error = || cases.iter().filter(|case| case.budget.error().is_some());
    let over: Vec<f64> = with_error().map(|case| case.over).collect();
    let means = with_error().filter(|case| case.budget.error().is_some_and(|term| term.statistic() == Statistic::Mean));
    vec![
        share("error over budget at most 1 on 256 unseen views", &over, 1.0, 0.95),
        value("error over budget, worst mean", means.map(|case| case.over).reduce(f64::max), 1.1),
    ]
}

/// How far predicted prices of first plans are off.
fn predictions(cases: &[Case]) -> Vec<Check> {
    let first = cases.iter().filter(|case| case.is_first);
    let off: Vec<f64> = first.flat_map(|case| case.predictions.iter().map(|ratio| (ratio - 1.0).abs())).collect();
    let of = |share: f64| (!off.is_empty()).then(|| quantile(off.clone(), share));
    let check = |name: &str, value, most| Check::maybe(name, value, "", Bar::AtMost(most), "no price was predicted");
    vec![
        check("error of predicted prices, median", of(0.5), 0.10),
        check("error of predicted prices, 90 %", of(0.9), 0.25),
    ]
}

fn times(cases: &[Case]) -> Vec<Check> {
    let seconds: Vec<f64> = cases.iter().map(|case| case.plan_s).collect();
    let percentile = |share: f64| (!seconds.is_empty()).then(|| quantile(seconds.clone(), share));
    let first = cases.iter().filter(|case| case.is_first).map(|case| case.plan_s).reduce(f64::max);
    let again = cases.iter().map(|case| case.again_s).reduce(f64::max);
    vec![
        seconds_check("time of a plan, median", percentile(0.5), 25.0),
        seconds_check("time of a plan, 90 %", percentile(0.9), 60.0),
        seconds_check("time of a plan, nothing kept, longest", first, 70.0),
        seconds_check("time of the same plan again, longest", again, 0.5),
    ]
}

/// A share of cases: the greatest that is not less likely than 5 % to give so few. It falls short where the true share is
/// below the bar with 95 % confidence.
fn share(name: &str, values: &[f64], most: f64, least_share: f64) -> Check {
    let over = values.iter().filter(|&&value| value > most).count();
    let held = values.len() - over;
    let name = format!("{name}: {held} of {}; bound of the share", values.len());
    let bound = (!values.is_empty()).then(|| greatest_share(values.len(), over));
    Check::maybe(name, bound, "", Bar::AtLeast(least_share), "no case")
}

/// The one-sided 95 % bound of a share, where `over` of `count` cases are not of it.
fn greatest_share(count: usize, over: usize) -> f64 {
    let (mut least, mut most) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = (least + most) / 2.0;
        match is_over(count, over, 1.0 - middle, ERROR_RATE) {
            true => most = middle,
            false => least = middle,
        }
    }
    least
}

fn value(name: &str, value: Option<f64>, most: f64) -> Check {
    Check::maybe(name, value, "×", Bar::AtMost(most), "no case")
}

fn seconds_check(name: &str, value: Option<f64>, most_s: f64) -> Check {
    Check::maybe(name, value, "s", Bar::AtMost(most_s), "no case")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_falls_short_only_where_chance_does_not_explain_it() {
        assert!(greatest_share(24, 0) > 0.999);
        // With a share of 0.95, 4 or more of 24 fail in 2.9 % of cases, and 3 or more in 11.6 %.
        assert!(greatest_share(24, 3) > 0.95 && greatest_share(24, 4) < 0.95);
        let of = |over: usize| share("share", &[vec![2.0; over], vec![1.0; 24 - over]].concat(), 1.0, 0.95);
        assert_eq!([3, 4].map(|over| of(over).outcome()), [report::Outcome::Holds, report::Outcome::FallsShort]);
        assert_eq!(share("share", &[], 1.0, 0.95).outcome(), report::Outcome::NotRun);
    }
}
