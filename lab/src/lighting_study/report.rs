//! The report of lightings.

use study::{Bar, Check, Report};

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

/// A sentence with the gain in the most expensive light; empty where no light was measured.
#[must_use]
pub fn summary(rows: &[Row]) -> String {
    let finest = rows.last().and_then(|row| Some((row, *row.pipelines.first()?)));
    finest.map_or_else(String::new, |(row, (views, seconds))| {
        let (lighting, gain) = (row.lighting, row.gain((views, seconds)));
        format!(
            "Where light is expensive ({lighting}): {views} views delivered in {seconds:.2} s, {gain:.1} times the throughput of drawing each from the scene."
        )
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_is_about_the_finest_light() {
        let row = |lighting: &str, direct_view_s| Row {
            lighting: lighting.parse().unwrap(),
            costs: cluster::Costs::default(),
            images: 4,
            nodes: 5,
            direct_views: 4,
            direct_view_s,
            pipelines: vec![(290, 10.0)],
        };
        let expected = "Where light is expensive (soft 4): 290 views delivered in 10.00 s, 14.5 times the throughput of drawing each from the scene.";
        assert_eq!(summary(&[row("phong", 0.01), row("soft 4", 0.5)]), expected);
        assert_eq!(summary(&[]), "");
    }
}
