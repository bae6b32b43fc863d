//! The table and the chart of a subject.

use report::{Axis, Better, Cell, Point, Report, Series, Table, XyChart};

use super::measure::LightFront;
use super::rows::{Drawing, LightRow};

/// Adds a subject's table and chart, and prints the table.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_to(report: &mut Report, front: &LightFront) -> anyhow::Result<()> {
    let table = table(front)?;
    println!("{}", table.to_markdown());
    report.parameter(format!("{}: truth", front.name), front.truth.as_str());
    report.tables.push(table);
    report.charts.push(chart(front).into());
    Ok(())
}

fn table(front: &LightFront) -> anyhow::Result<Table> {
    let columns = [
        ("representation", ""),
        ("S", ""),
        ("density", ""),
        ("a view", "ms"),
        ("sampling", "s"),
        ("FLIP", ""),
        ("PSNR", "dB"),
        ("unknown", "%"),
        ("on the front", ""),
        ("gain at equal FLIP", "×"),
        ("faster than direct from", "views"),
    ];
    let mut table = Table::new(format!("Expensive light, {}", front.name), &columns);
    let direct = front.direct();
    for row in &front.rows {
        let saved_s = (direct.least_ms_at(row.flip) - row.view_ms) * 1e-3;
        let views = (saved_s > 0.0).then(|| (row.sampling_s / saved_s).floor() + 1.0);
        let set = row.set;
        table.push([
            Cell::from(row.drawing.to_string()),
            set.map(|set| set.images).into(),
            set.map(|set| set.density).into(),
            row.view_ms.into(),
            set.map(|_| row.sampling_s).into(),
            row.flip.into(),
            row.psnr_db.into(),
            row.unknown.map(|share| share * 100.0).into(),
            front.is_on_front(row).into(),
            set.map(|_| direct.gain(&row.point())).into(),
            set.and(views).into(),
        ])?;
    }
    Ok(table)
}

fn chart(front: &LightFront) -> XyChart {
    let title = format!("FLIP against time, {}", front.name);
    let mut chart = XyChart::new(title, Axis::log("a view", "ms"), Axis::log("Foreground FLIP", ""));
    let mut series: Vec<String> = front.rows.iter().map(series_name).collect();
    series.sort();
    series.dedup();
    for name in series {
        let rows = front.rows.iter().filter(|row| series_name(row) == name);
        let points: Vec<Point> = rows.map(point).collect();
        let is_direct = name == "direct";
        chart = chart.with(if is_direct { Series::line(name, points) } else { Series::points(name, points) });
    }
    chart = chart.with_front(Better::Low, Better::Low);
    chart.note =
        "Sampling is not part of the time of a view. Labels: rays of occlusion or of indirect light a position, in \
        direct drawing."
            .to_owned();
    chart
}

fn series_name(row: &LightRow) -> String {
    match row.drawing {
        Drawing::Direct(_) => "direct".to_owned(),
        Drawing::LightCache(_) | Drawing::JointCarve => row.drawing.to_string(),
    }
}

fn point(row: &LightRow) -> Point {
    let label = match row.drawing {
        Drawing::Direct(rays) => rays.ambient.to_string(),
        Drawing::LightCache(_) | Drawing::JointCarve => String::new(),
    };
    Point::labelled(row.view_ms, row.flip, label)
}
