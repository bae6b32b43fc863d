//! The table, charts and checks of scenes.

use report::{Axis, Bar, Cell, Check, Report, Series, Table, XyChart};

use super::measure::{REFERENCE, Row, SHARED, SceneResult};
use super::subjects::OUTSIDE_SCENES;
use crate::statistics::geometric_mean;

/// The scene that gains most.
const EXPENSIVE_SCENE: &str = "tree-terrain-500k";
/// Scenes whose look-ups are compared with their surfaces.
const LOOK_UP_SCENES: [&str; 4] = ["FlightHelmet", EXPENSIVE_SCENE, "courtyard", "urban"];

struct QualityBars {
    quality: &'static str,
    mean_psnr_db: f64,
    least_psnr_db: f64,
    greatest_flip: f64,
}

const QUALITY_BARS: [QualityBars; 2] = [
    QualityBars { quality: "balanced", mean_psnr_db: 43.0, least_psnr_db: 38.0, greatest_flip: 0.022 },
    QualityBars { quality: "fast", mean_psnr_db: 39.0, least_psnr_db: 34.0, greatest_flip: 0.033 },
];

/// Adds the tables of all scenes, a chart and pictures of each, and the checks.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_to(report: &mut Report, results: &[SceneResult]) -> anyhow::Result<()> {
    if results.is_empty() {
        return Ok(());
    }
    report.tables.push(table(results)?);
    let mut look_ups = Table::new("`draft`, 1 sample a pixel", &[("scene", ""), ("look-up over surfaces", "×")]);
    for result in results {
        look_ups.push([result.name.clone().into(), result.look_up_ratio.into()])?;
    }
    report.tables.push(look_ups);
    report.charts.extend(results.iter().map(|result| chart(result).into()));
    report.pictures.extend(results.iter().map(|result| result.pictures.clone()));
    add_quality_checks(report, results);
    add_gain_checks(report, results);
    add_time_checks(report, results);
    Ok(())
}

fn table(results: &[SceneResult]) -> anyhow::Result<Table> {
    let columns = [
        ("scene", ""),
        ("light", ""),
        ("a view", "ms"),
        ("PSNR", "dB"),
        ("FLIP", ""),
        ("FLIP against the truth", ""),
        ("unknown", "%"),
        ("gain at equal FLIP", "×"),
    ];
    let mut table = Table::new("Views of each scene", &columns);
    for result in results {
        for row in result.direct.iter().chain(&result.qualities) {
            let is_cached = result.qualities.contains(row);
            let gain = result.gain(row);
            let gain_cell = if gain.is_lower_bound { format!("> {:.2}", gain.ratio).into() } else { gain.ratio.into() };
            table.push([
                result.name.clone().into(),
                row.name.clone().into(),
                row.ms.into(),
                row.psnr_db.into(),
                row.flip.into(),
                row.truth_flip.into(),
                if is_cached { (row.unknown * 100.0).into() } else { Cell::Missing },
                if is_cached { gain_cell } else { Cell::Missing },
            ])?;
        }
    }
    Ok(table)
}

fn chart(result: &SceneResult) -> XyChart {
    let point = |row: &Row| (row.ms, row.truth_flip);
    let time = Axis::log("a view", "ms");
    let mut chart = XyChart::new(format!("FLIP over time, {}", result.name), time, Axis::log("FLIP", ""))
        .with(Series::line("direct", result.direct.iter().map(point)));
    for row in &result.qualities {
        chart = chart.with(Series::points(row.name.clone(), [point(row)]));
    }
    chart.note = "Errors over the foreground against a truth with other noise.".to_owned();
    chart
}

fn add_quality_checks(report: &mut Report, results: &[SceneResult]) {
    for bars in QUALITY_BARS {
        let named = |result: &SceneResult| result.qualities.iter().find(|row| row.name == bars.quality).cloned();
        let rows: Vec<Row> = results.iter().filter_map(named).collect();
        let mean_db = rows.iter().map(|row| row.psnr_db).sum::<f64>() / rows.len() as f64;
        let least_db = rows.iter().map(|row| row.psnr_db).fold(f64::INFINITY, f64::min);
        let flip = rows.iter().map(|row| row.flip).fold(0.0, f64::max);
        let name = |what: &str| format!("`{}`, {} scenes: {what}", bars.quality, rows.len());
        report.checks.extend([
            Check::new(name("mean PSNR"), mean_db, "dB", Bar::AtLeast(bars.mean_psnr_db)),
            Check::new(name("least PSNR"), least_db, "dB", Bar::AtLeast(bars.least_psnr_db)),
            Check::new(name("greatest FLIP"), flip, "", Bar::AtMost(bars.greatest_flip)),
        ]);
    }
}

fn add_gain_checks(report: &mut Report, results: &[SceneResult]) {
    let mut gains = Vec::new();
    let mut expensive = None;
    for result in results.iter().filter(|result| result.is_outside) {
        let Some((_, gain)) = result.best_quality() else { continue };
        gains.push(gain.ratio);
        if result.name == EXPENSIVE_SCENE {
            expensive = Some(gain.ratio);
        }
    }
    let name = |what: &str| format!("gain of the best quality at equal FLIP, {what}");
    let all = (gains.len() == OUTSIDE_SCENES).then(|| geometric_mean(&gains)).flatten();
    let not_all = format!("{} of {OUTSIDE_SCENES} outside scenes are measured", gains.len());
    let least = gains.iter().copied().reduce(f64::min);
    report.checks.extend([
        Check::maybe(name(EXPENSIVE_SCENE), expensive, "×", Bar::AtLeast(2.5), "the scene is not measured"),
        Check::maybe(name("geometric mean"), all, "×", Bar::AtLeast(1.3), not_all),
        Check::maybe(name("least"), least, "×", Bar::AtLeast(0.8), "no outside scene is measured"),
    ]);
}

fn add_time_checks(report: &mut Report, results: &[SceneResult]) {
    let is_wanted = |result: &&SceneResult| LOOK_UP_SCENES.contains(&result.name.as_str());
    let look_ups: Vec<f64> = results.iter().filter(is_wanted).map(|result| result.look_up_ratio).collect();
    let all = (look_ups.len() == LOOK_UP_SCENES.len()).then(|| geometric_mean(&look_ups)).flatten();
    let missing = format!("{} of {} are measured", look_ups.len(), LOOK_UP_SCENES.join(", "));
    let ratio = |result: &SceneResult| result.direct[SHARED].ms / result.direct[REFERENCE].ms;
    let shared = geometric_mean(&results.iter().map(ratio).collect::<Vec<_>>());
    let psnr = |result: &SceneResult| result.direct[SHARED].psnr_db;
    let least_db = results.iter().map(psnr).fold(f64::INFINITY, f64::min);
    report.checks.extend([
        Check::maybe("`draft`, 1 sample a pixel: time of look-up over surfaces", all, "×", Bar::AtMost(0.9), missing),
        Check::maybe("direct: time with rays a pixel over rays a position", shared, "×", Bar::AtMost(0.45), "no scene"),
        Check::new("direct with rays a pixel: least PSNR", least_db, "dB", Bar::AtLeast(40.0)),
    ]);
}
