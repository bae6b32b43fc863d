//! The report of the guests: a table and the checks.

use study::{Bar, Cell, Check, Report, Table};

use super::beside::Row;
use super::guests::Guest;

/// The longest time without a new frame.
const LONGEST_GAP_S: f64 = 1.0;
/// The least share of poses that are shown.
const SHOWN: f64 = 0.9;
/// The longest time of a batch beside the viewer, over its time alone.
const BESIDE_OVER_ALONE: f64 = 2.5;
/// The most that the first view of a new size waits longer than that of a known one.
const NEW_SIZE_S: f64 = 0.3;

/// All that was measured.
pub(super) struct Measured {
    /// Guests; `None` where one could not be measured.
    pub(super) rows: Vec<(&'static Guest, Option<Row>)>,
    /// Seconds until the first view of a known size, and of a new one.
    pub(super) new_size_s: [f64; 2],
}

/// Adds the table and the checks.
pub(super) fn add(measured: &Measured, report: &mut Report) -> anyhow::Result<()> {
    let columns = [
        ("beside the viewer", ""),
        ("longest gap", "s"),
        ("poses shown", "%"),
        ("first visit", "s"),
        ("beside", "s"),
        ("alone", "s"),
    ];
    let mut table = Table::new("A viewer beside other clients", &columns);
    for (guest, row) in &measured.rows {
        let name = guest.name;
        let numbers = row.map_or([f64::NAN; 5], |row| {
            [row.watched.longest_gap_s, row.watched.shown_share * 100.0, row.first_s, row.beside_s, row.alone_s]
        });
        table.push([Cell::from(name)].into_iter().chain(numbers.map(Cell::from)))?;
        report.checks.extend(checks(guest, *row));
    }
    report.tables.push(table);
    let [known_s, new_s] = measured.new_size_s;
    let mut sizes = Table::new("The first view of a session", &[("size", ""), ("time", "s")]);
    sizes.push([Cell::from("known"), known_s.into()])?;
    sizes.push([Cell::from("new"), new_s.into()])?;
    report.tables.push(sizes);
    report.checks.push(Check::new(
        "first view of a new size, more than of a known one",
        new_s - known_s,
        "s",
        Bar::AtMost(NEW_SIZE_S),
    ));
    Ok(())
}

/// A guest that could not be measured falls short of every bar. The time of one that shares the viewer's workload has a bar,
/// for others take nodes of their own.
fn checks(guest: &Guest, row: Option<Row>) -> Vec<Check> {
    let name = guest.name;
    let of = |figure: fn(&Row) -> f64, worst: f64| row.as_ref().map_or(worst, figure);
    let [gap, shown, ratio] =
        [": longest gap", ": poses shown", ": beside over alone"].map(|what| format!("{name}{what}"));
    let mut checks = vec![
        Check::new(gap, of(|row| row.watched.longest_gap_s, f64::INFINITY), "s", Bar::AtMost(LONGEST_GAP_S)),
        Check::new(shown, of(|row| row.watched.shown_share * 100.0, 0.0), "%", Bar::AtLeast(SHOWN * 100.0)),
    ];
    if guest.shares_workload() {
        let times = of(|row| row.beside_s / row.alone_s, f64::INFINITY);
        checks.push(Check::new(ratio, times, "", Bar::AtMost(BESIDE_OVER_ALONE)));
    }
    checks
}
