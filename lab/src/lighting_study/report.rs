//! The report of lightings.

use report::{Bar, Check, Report};

use super::charts::{ratio_chart, throughput_chart, total_time_chart};
use super::measure::{FINE, Row};
use super::tables::{gains, parts};

/// The least share of the gain that the parts allow that must arrive at a client.
const SHARE_OF_PARTS: f64 = 0.8;

/// Adds tables and charts.
pub fn report(rows: &[Row], lamps: usize, report: &mut Report) -> anyhow::Result<()> {
    report.tables.push(gains(rows)?);
    report.tables.push(parts(rows)?);
    report.charts.push(ratio_chart(rows, lamps).into());
    report.charts.push(throughput_chart(rows, lamps).into());
    report.charts.push(total_time_chart(rows).into());
    Ok(())
}

/// Checks of the finest lighting.
#[must_use]
pub fn checks(rows: &[Row]) -> Vec<Check> {
    let fine = rows.iter().find(|row| row.lighting.to_string() == FINE);
    let of_parts = fine.iter().flat_map(|row| {
        row.pipelines.iter().map(|&(views, seconds)| {
            let share = row.gain((views, seconds)) / row.allowed(views);
            let name = format!("{FINE}, {views} views: gain over direct, share of what the parts allow");
            Check::new(name, share, "", Bar::AtLeast(SHARE_OF_PARTS))
        })
    });
    of_parts.collect()
}
