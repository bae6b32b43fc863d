//! Ambient occlusion from z-buffers: the view's own, that of a graph camera, which sees behind things (Rosen et al., section 6.3), and all
//! images of a sample set.

mod methods;
mod pictures;
mod search;
mod subject;

use anyhow::Context as _;
use glam::UVec2;
use report::{Axis, Bar, Check, Point, Report, Series, XyChart};

use self::methods::{COLUMNS, GRAPH, KEPT, METHODS, MethodFigures, OWN, SHARED, Walk};
use self::subject::{ARC_RAD, Blocks, view};
use crate::failures::stand::Stand;
use crate::study::{measure_rows, table};

/// Views along the walk, in full and in quick runs.
const VIEWS: [usize; 2] = [21, 9];
const VIEW_PX: [UVec2; 2] = [UVec2::new(640, 480), UVec2::new(320, 240)];

/// Adds table, chart, checks and pictures to a report.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let size = usize::from(is_quick);
    let blocks = Blocks::new(stand)?;
    let points = blocks.points();
    let angles: Vec<f32> = (0..VIEWS[size]).map(|number| angle_rad(number, VIEWS[size])).collect();
    let views = angles.iter().map(|&angle_rad| view(angle_rad, VIEW_PX[size])).collect();
    let walk = Walk::new(&blocks, &points, views);
    let rows = measure_rows("horizons", METHODS, |method| walk.measure(&method))?;
    report.tables.push(table("Occlusion of the floor beside the hidden block", &COLUMNS, &rows)?);
    report.charts.push(along_walk(&angles, &walk.truth_by_view(), &rows));
    report.checks.extend(checks(&walk, &rows)?);
    report.pictures.push(pictures::head_on(&blocks, is_quick)?);
    Ok(())
}

fn angle_rad(number: usize, views: usize) -> f32 {
    ARC_RAD * (2.0 * number as f32 / (views - 1) as f32 - 1.0)
}

fn along_walk(angles: &[f32], truth: &[f64], rows: &[MethodFigures]) -> XyChart {
    let chart = XyChart::new(
        "Occlusion beside the hidden block along the walk",
        Axis::linear("angle", "rad"),
        Axis::linear("mean occlusion", ""),
    );
    let shown = rows.iter().filter(|row| [OWN, GRAPH, KEPT, SHARED].contains(&row.name));
    shown.fold(chart.with(series("rays", angles, truth)), |chart, row| {
        chart.with(series(row.name, angles, &row.by_view))
    })
}

fn series(name: &str, angles: &[f32], values: &[f64]) -> Series {
    let points = angles.iter().zip(values).map(|(angle, value)| Point::from((f64::from(*angle), *value)));
    Series::line(name, points)
}

fn find<'r>(rows: &'r [MethodFigures], name: &str) -> anyhow::Result<&'r MethodFigures> {
    rows.iter().find(|row| row.name == name).with_context(|| format!("{name} was not measured"))
}

fn checks(walk: &Walk<'_>, rows: &[MethodFigures]) -> anyhow::Result<Vec<Check>> {
    let [own, graph, shared] = [find(rows, OWN)?, find(rows, GRAPH)?, find(rows, SHARED)?];
    let truth = walk.truth_by_view();
    let middle = truth[truth.len() / 2];
    Ok(vec![
        Check::new("hidden-block: occlusion head-on by rays", middle, "", Bar::AtLeast(0.2)),
        Check::new("hidden-block: own horizons over rays, head-on", own.head_on / middle, "×", Bar::AtMost(0.2)),
        Check::new("hidden-block: RMSE of graph over own", graph.rmse / own.rmse, "×", Bar::AtMost(0.85)),
        Check::new("hidden-block: RMSE of shared over own", shared.rmse / own.rmse, "×", Bar::AtMost(0.5)),
        Check::new(
            "hidden-block: deviation of graph over own",
            graph.deviation / own.deviation,
            "×",
            Bar::AtMost(0.65),
        ),
    ])
}
