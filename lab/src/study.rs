//! The frame of every study: its options, rows that are data, tables and charts of rows, and the end of a run.
//!
//! A study is a list of rows and a function that measures one. What it reports of a row is a list of [`Column`]s.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use app_core::exit::Outcome;
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use report::{Bar, Cell, Check, Mark, Point, Report, Series, Table, XyChart};

use crate::markdown::markdown;

/// Options of every bench and study.
#[derive(Debug, Args)]
pub struct RunArgs {
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Where the report goes, in place of out/bench, out/bench-NAME or out/study/NAME
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Runs a smaller form: fewer subjects or repeats, fewer or smaller views
    #[arg(long)]
    pub quick: bool,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

/// What a study reports of a row.
pub struct Column<R> {
    name: &'static str,
    unit: &'static str,
    cell: fn(&R) -> Cell,
}

impl RunArgs {
    /// # Errors
    /// There is no such device.
    pub fn engine(&self) -> anyhow::Result<Arc<GpuEngine>> {
        Ok(GpuEngine::shared(self.device.device)?)
    }

    pub fn report(&self, title: &str, engine: &GpuEngine) -> Report {
        let mut report = new_report(format!("Myriorama study: {title}"), &engine.device_name());
        report.parameter("quick", self.quick);
        report
    }

    /// The folder of the report, unless another is given.
    pub fn folder<'a>(&'a self, usual: &'a str) -> &'a Path {
        self.out.as_deref().unwrap_or(Path::new(usual))
    }

    /// Prints the tables and writes the report to its usual folder, unless another is given.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn finish(&self, usual_folder: &str, report: &Report) -> anyhow::Result<Outcome> {
        report.tables.iter().for_each(|table| println!("{}", markdown(table)));
        self.write(usual_folder, report)
    }

    /// Writes the report as [`Self::finish`] does, and prints no tables.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn write(&self, usual_folder: &str, report: &Report) -> anyhow::Result<Outcome> {
        let holds = report.finish(self.folder(usual_folder))?;
        Ok(Outcome::of(holds || !self.strict))
    }
}

/// A report with the program's version.
pub fn new_report(title: impl Into<String>, device: &str) -> Report {
    let mut report = Report::new(title, device);
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report
}

/// Compares a value with the bar; without a value, the check was not run for `reason`.
pub fn check_if_measured(
    name: impl Into<String>,
    value: Option<f64>,
    unit: impl Into<String>,
    bar: Bar,
    reason: impl Into<String>,
) -> Check {
    match value {
        Some(value) => Check::new(name, value, unit, bar),
        None => Check::not_run(name, unit, bar, reason),
    }
}

impl<R> Column<R> {
    /// A column without a unit.
    pub const fn new(name: &'static str, cell: fn(&R) -> Cell) -> Self {
        Self { name, unit: "", cell }
    }

    pub const fn with_unit(name: &'static str, unit: &'static str, cell: fn(&R) -> Cell) -> Self {
        Self { name, unit, cell }
    }
}

/// Whether a name contains one of the texts, in any case; without texts all names do.
pub fn is_named(name: &str, texts: &[String]) -> bool {
    let name = name.to_lowercase();
    texts.is_empty() || texts.iter().any(|text| name.contains(&text.to_lowercase()))
}

/// A table with a row for each of `rows`.
///
/// # Errors
/// A row does not fit the table.
pub fn table<'r, R: 'r>(
    name: impl Into<String>,
    columns: &[Column<R>],
    rows: impl IntoIterator<Item = &'r R>,
) -> anyhow::Result<Table> {
    let headings: Vec<(&str, &str)> = columns.iter().map(|column| (column.name, column.unit)).collect();
    let mut table = Table::new(name, &headings);
    for row in rows {
        table.push(columns.iter().map(|column| (column.cell)(row)))?;
    }
    Ok(table)
}

/// Measures one row after the other, and shows how far it is.
///
/// # Errors
/// The first error of a row.
pub fn measure_rows<S, R>(
    name: &str,
    rows: impl IntoIterator<Item = S, IntoIter: ExactSizeIterator>,
    mut measure: impl FnMut(S) -> anyhow::Result<R>,
) -> anyhow::Result<Vec<R>> {
    let rows = rows.into_iter();
    let progress = bar(name.to_owned(), rows.len());
    let measured = rows
        .map(|row| {
            let measured = measure(row);
            progress.inc(1);
            measured
        })
        .collect();
    progress.finish_and_clear();
    measured
}

/// Adds rows to a chart as a series of points for each name, in the order in which names first occur.
pub fn with_series<R>(
    chart: XyChart,
    rows: &[R],
    mark: Mark,
    name: fn(&R) -> String,
    point: impl Fn(&R) -> Point,
) -> XyChart {
    let mut names: Vec<String> = Vec::new();
    for row in rows {
        let name = name(row);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.into_iter().fold(chart, |chart, series| {
        let points: Vec<Point> = rows.iter().filter(|row| name(row) == series).map(&point).collect();
        chart.with(match mark {
            Mark::Line => Series::line(series, points),
            Mark::Points => Series::points(series, points),
        })
    })
}

#[cfg(test)]
mod tests {
    use report::Axis;

    use super::*;

    const COLUMNS: [Column<(u32, f64)>; 2] =
        [Column::new("rays", |row| row.0.into()), Column::with_unit("time", "ms", |row| row.1.into())];

    #[test]
    fn a_table_has_a_row_for_each_row_and_a_chart_a_series_for_each_name() {
        let rows = measure_rows("rows", [1_u32, 2, 3], |rays| Ok((rays, f64::from(rays) * 0.5))).unwrap();
        let table = table("Rays", &COLUMNS, &rows).unwrap();
        assert_eq!(table.rows[2], [Cell::from(3_u32), Cell::from(1.5)]);
        assert_eq!(table.columns[1].unit, "ms");
        let name = |row: &(u32, f64)| if row.0 == 2 { "even".to_owned() } else { "odd".to_owned() };
        let chart = XyChart::new("Rays", Axis::linear("time", "ms"), Axis::linear("rays", ""));
        let chart = with_series(chart, &rows, Mark::Line, name, |row| (row.1, f64::from(row.0)).into());
        let lengths: Vec<usize> = chart.series.iter().map(|series| series.points.len()).collect();
        assert_eq!(lengths, [2, 1]);
    }

    #[test]
    fn the_first_row_that_fails_ends_the_study() {
        let measured = measure_rows("rows", [1, 2, 3], |row| {
            anyhow::ensure!(row != 2, "row {row}");
            Ok(row)
        });
        assert_eq!(measured.unwrap_err().to_string(), "row 2");
    }
}
