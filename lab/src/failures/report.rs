//! Curves as a table, charts and checks.

use report::{Axis, Bar, Cell, Check, Report, Series, Table, XyChart};

use super::curve::{Curve, Measured};
use super::stand::Stand;

/// A curve's values and the violations of its series, or why there are none.
pub struct Result {
    curve: &'static Curve,
    measured: anyhow::Result<Measured>,
}

impl Result {
    pub fn of(curve: &'static Curve, stand: &Stand) -> Self {
        Self { curve, measured: curve.measured(stand) }
    }

    /// Of each series, the reason for which it does not hold.
    fn reasons(&self) -> Vec<Option<String>> {
        match &self.measured {
            Ok(measured) => self.curve.violations(measured).map(|violation| violation.map(|v| v.to_string())).collect(),
            Err(error) => vec![Some(format!("not measured: {error:#}")); self.curve.series.len()],
        }
    }
}

/// Adds the table of shapes, a chart a curve and the check.
///
/// # Errors
/// A row that does not fit the table.
pub fn add_to(report: &mut Report, results: &[Result]) -> anyhow::Result<()> {
    report.tables.push(table(results)?);
    report.charts.extend(results.iter().filter_map(chart));
    let lost = results.iter().flat_map(Result::reasons).flatten().count();
    report.checks.push(Check::new("shapes that do not hold", lost as f64, "", Bar::Equal(0.0)));
    Ok(())
}

fn table(results: &[Result]) -> anyhow::Result<Table> {
    let columns = [
        ("curve", ""),
        ("subject", ""),
        ("series", ""),
        ("shape", ""),
        ("first", ""),
        ("last", ""),
        ("holds", ""),
        ("why", ""),
    ];
    let mut table = Table::new("Curves and their shapes", &columns);
    for result in results {
        let Curve { name, subject, series, why, .. } = result.curve;
        for (place, (series, reason)) in series.iter().zip(result.reasons()).enumerate() {
            let shapes: Vec<String> = series.shapes.iter().map(ToString::to_string).collect();
            let y = result.measured.as_ref().map(|measured| measured.ys[place].as_slice()).unwrap_or_default();
            let holds = reason.map_or_else(|| Cell::Flag(true), |reason| format!("no: {reason}").into());
            let cells: [Cell; 8] = [
                (*name).into(),
                (*subject).into(),
                series.name.into(),
                shapes.join("; ").into(),
                y.first().copied().into(),
                y.last().copied().into(),
                holds,
                (*why).into(),
            ];
            table.push(cells)?;
        }
    }
    Ok(table)
}

/// `None` of a curve that was not measured.
fn chart(result: &Result) -> Option<XyChart> {
    let curve = result.curve;
    let measured = result.measured.as_ref().ok()?;
    let x =
        if curve.x.is_log { Axis::log(curve.x.label, curve.x.unit) } else { Axis::linear(curve.x.label, curve.x.unit) };
    let [label, unit] = curve.y;
    let mut chart = XyChart::new(curve.name, x, Axis::linear(label, unit));
    for (series, y) in curve.series.iter().zip(&measured.ys) {
        chart = chart.with(Series::line(series.name, measured.x.iter().copied().zip(y.iter().copied())));
    }
    chart.note = format!("{}: {}", curve.subject, curve.why);
    Some(chart)
}
