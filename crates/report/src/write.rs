//! Files of a report.

use std::collections::HashSet;
use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

use crate::table::Table;

use crate::chart::{Chart, Palette};
use crate::check_text::checks_text;
use crate::error::ReportError;
use crate::html;
use crate::paths::{chart_path, picture_path, table_path};
use crate::report::Report;
use crate::slug::slug;

impl Report {
    /// Writes the report to a folder, which is made if need be: `report.json`, `index.html`, a CSV file a table,
    /// `charts/*.svg` and `pictures/*.png`.
    ///
    /// # Errors
    /// Parts do not fit together, names collide, or the folder cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ReportError> {
        write(self, folder)
    }

    /// Writes the report, prints its path and its checks, and returns [`Report::exit_ok`].
    ///
    /// # Errors
    /// The report cannot be written.
    pub fn finish(&self, folder: &Path) -> Result<bool, ReportError> {
        self.write(folder)?;
        // Nobody may be reading any more.
        let _ = writeln!(io::stdout(), "report: {}", folder.join("index.html").display());
        let _ = writeln!(io::stdout(), "{}", checks_text(&self.checks));
        Ok(self.exit_ok())
    }
}

/// Everything is validated and drawn before the first file is written.
fn write(report: &Report, folder: &Path) -> Result<(), ReportError> {
    validate(report)?;
    let palette = Palette::for_names(report.charts.iter().flat_map(Chart::series_names));
    let charts = report.charts.iter().map(|chart| chart.draw(&palette)).collect::<Result<Vec<_>, _>>()?;
    let page = html::page(report, charts.iter().map(|chart| chart.inline()).collect())?;
    make_folders(report, folder)?;
    for (chart, drawing) in report.charts.iter().zip(&charts) {
        write_file(&folder.join(chart_path(chart)), drawing.standalone().as_bytes())?;
    }
    for table in &report.tables {
        write_file(&folder.join(table_path(table)), &table.to_csv()?)?;
    }
    write_pictures(report, folder)?;
    write_file(&folder.join("report.json"), serde_json::to_string_pretty(report)?.as_bytes())?;
    write_file(&folder.join("index.html"), page.as_bytes())
}

fn validate(report: &Report) -> Result<(), ReportError> {
    report.tables.iter().try_for_each(Table::validate)?;
    expect_distinct("tables", report.tables.iter().map(|table| table.name.as_str()))?;
    expect_distinct("charts", report.charts.iter().map(Chart::name))?;
    expect_distinct("pictures", report.all_pictures().map(|picture| picture.name.as_str()))
}

fn expect_distinct<'a>(kind: &'static str, names: impl Iterator<Item = &'a str>) -> Result<(), ReportError> {
    let mut seen = HashSet::new();
    match names.map(slug).find(|name| !seen.insert(name.clone())) {
        Some(name) => Err(ReportError::DuplicateName { kind, name }),
        None => Ok(()),
    }
}

fn make_folders(report: &Report, folder: &Path) -> Result<(), ReportError> {
    let parts = [("charts", report.charts.is_empty()), ("pictures", report.all_pictures().next().is_none())];
    let used = parts.iter().filter(|(_, empty)| !empty).map(|(part, _)| folder.join(part));
    for path in std::iter::once(folder.to_path_buf()).chain(used) {
        fs::create_dir_all(&path).map_err(|source| ReportError::Io { path, source })?;
    }
    Ok(())
}

fn write_pictures(report: &Report, folder: &Path) -> Result<(), ReportError> {
    for picture in report.all_pictures() {
        picture.image.save_with_format(folder.join(picture_path(&picture.name)), image::ImageFormat::Png)?;
    }
    Ok(())
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    fs::write(path, bytes).map_err(|source| ReportError::Io { path: path.into(), source })
}
