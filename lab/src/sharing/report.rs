//! The table of the guests and its checks.

use report::{Bar, Cell, Check, Table};

use super::beside::Row;
use super::guests::Guest;
use crate::section::Section;

/// The longest time without a new frame.
const LONGEST_GAP_S: f64 = 1.0;
/// The least share of poses that are shown.
const SHOWN: f64 = 0.9;
/// The longest time of a batch beside the viewer, over its time alone.
const BESIDE_OVER_ALONE: f64 = 2.5;

/// The section of all guests; a row is `None` where a guest could not be measured.
///
/// # Errors
/// A row does not fit its table.
pub(super) fn section(rows: &[(&'static Guest, Option<Row>)], device: String) -> anyhow::Result<Section> {
    let columns = [
        ("beside the viewer", ""),
        ("policy", ""),
        ("longest gap", "s"),
        ("worst repeat", "s"),
        ("poses shown", "%"),
        ("worst repeat", "%"),
        ("first visit", "s"),
        ("beside", "s"),
        ("alone", "s"),
    ];
    let mut table = Table::new("A viewer beside other clients", &columns);
    let mut section = Section { device, ..Section::default() };
    for (guest, row) in rows {
        let policies = row.as_ref().map_or_else(String::new, |row| row.policies.clone());
        let numbers = row.as_ref().map_or([f64::NAN; 7], figures);
        let name = Cell::from(guest.name);
        table.push([name, policies.into()].into_iter().chain(numbers.map(Cell::from)))?;
        section.checks.extend(checks(guest, row.as_ref()));
    }
    section.tables.push(table);
    Ok(section)
}

fn figures(row: &Row) -> [f64; 7] {
    [
        row.median(|visit| visit.watched.longest_gap_s),
        row.worst_gap_s(),
        row.median(|visit| visit.watched.shown_share) * 100.0,
        row.worst_shown_share() * 100.0,
        row.median(|visit| visit.first_s),
        row.median(|visit| visit.beside_s),
        row.median(|visit| visit.alone_s),
    ]
}

/// A guest that could not be measured falls short of every bar. The time of one that shares the viewer's workload has a bar,
/// for others take nodes of their own.
fn checks(guest: &Guest, row: Option<&Row>) -> Vec<Check> {
    let [gap_s, shown, times] = row.map_or([f64::INFINITY, 0.0, f64::INFINITY], |row| {
        [
            row.median(|visit| visit.watched.longest_gap_s),
            row.median(|visit| visit.watched.shown_share),
            row.median(|visit| visit.beside_s / visit.alone_s),
        ]
    });
    let name = guest.name;
    let mut checks = vec![
        Check::new(format!("{name}: longest gap"), gap_s, "s", Bar::AtMost(LONGEST_GAP_S)),
        Check::new(format!("{name}: poses shown"), shown * 100.0, "%", Bar::AtLeast(SHOWN * 100.0)),
    ];
    if guest.shares_workload() {
        checks.push(Check::new(format!("{name}: beside over alone"), times, "", Bar::AtMost(BESIDE_OVER_ALONE)));
    }
    checks
}
