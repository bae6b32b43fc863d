//! The page of a report.

use minijinja::{Environment, Value, context};

use crate::table::{Column, Table};

use crate::check::{Check, Outcome};
use crate::error::ReportError;
use crate::paths::{chart_path, picture_path, table_path};
use crate::picture::{Picture, PictureRow};
use crate::report::Report;

/// Fills in the page. All text of the report is escaped; charts are SVG.
pub(crate) fn page(report: &Report, charts: &[String]) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    // Names that end in .html are escaped.
    environment.add_template("index.html", include_str!("index.html"))?;
    Ok(environment.get_template("index.html")?.render(context! {
        title => report.title.as_str(),
        summary => report.summary.as_str(),
        cover => report.cover.as_ref().map(picture),
        device => report.device.as_str(),
        versions => named(report.versions.iter().map(|(name, version)| (name, version.clone()))),
        parameters => named(report.parameters.iter().map(|(name, value)| (name, value.display()))),
        checks => report.checks.iter().map(check).collect::<Vec<_>>(),
        charts => report.charts.iter().zip(charts).map(|(chart, svg)| context! {
            svg => Value::from_safe_string(svg.clone()),
            file => chart_path(chart),
            note => chart.note.as_str(),
        }).collect::<Vec<_>>(),
        tables => report.tables.iter().map(table).collect::<Vec<_>>(),
        pictures => report.pictures.iter().map(pictures).collect::<Vec<_>>(),
    })?)
}

fn named<'a>(entries: impl Iterator<Item = (&'a String, String)>) -> Vec<Value> {
    entries.map(|(name, value)| context! { name, value }).collect()
}

fn check(check: &Check) -> Value {
    let class = match check.outcome() {
        Outcome::Holds => "holds",
        Outcome::FallsShort => "short",
        Outcome::NotRun => "unrun",
    };
    context! {
        name => check.name.as_str(),
        value => check.value_text(),
        bar => check.bar_text(),
        class,
        words => check.outcome().words().to_lowercase(),
        reason => check.reason.as_deref(),
    }
}

fn table(table: &Table) -> Value {
    let rows = table.rows.iter().map(|row| {
        let cells = row.iter().map(|cell| context! { text => cell.display(), numeric => cell.is_numeric() });
        cells.collect::<Vec<_>>()
    });
    context! {
        name => table.name.as_str(),
        file => table_path(table),
        columns => table.columns.iter().map(Column::heading).collect::<Vec<_>>(),
        rows => rows.collect::<Vec<_>>(),
    }
}

fn pictures(row: &PictureRow) -> Value {
    context! { title => row.title.as_str(), pictures => row.pictures.iter().map(picture).collect::<Vec<_>>() }
}

fn picture(picture: &Picture) -> Value {
    let legend = picture.legend.iter().map(|(name, [r, g, b])| context! { name, color => format!("rgb({r},{g},{b})") });
    context! {
        file => picture_path(&picture.name),
        caption => picture.caption.as_str(),
        width => picture.image.width(),
        height => picture.image.height(),
        legend => legend.collect::<Vec<_>>(),
    }
}
