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
        // Everything is validated and drawn before the first file is written.
        self.validate()?;
        let palette = Palette::for_names(self.charts.iter().flat_map(Chart::series_names));
        let charts = self.charts.iter().map(|chart| chart.draw(&palette)).collect::<Result<Vec<_>, _>>()?;
        let page = html::page(self, &charts)?;
        self.make_folders(folder)?;
        for (chart, drawing) in self.charts.iter().zip(&charts) {
            write_file(&folder.join(chart_path(chart)), standalone(drawing).as_bytes())?;
        }
        for table in &self.tables {
            write_file(&folder.join(table_path(table)), &table.to_csv()?)?;
        }
        for picture in self.all_pictures() {
            picture.image.save_with_format(folder.join(picture_path(&picture.name)), image::ImageFormat::Png)?;
        }
        write_file(&folder.join("report.json"), serde_json::to_string_pretty(self)?.as_bytes())?;
        write_file(&folder.join("index.html"), page.as_bytes())
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

    fn validate(&self) -> Result<(), ReportError> {
        self.tables.iter().try_for_each(Table::validate)?;
        expect_distinct("tables", self.tables.iter().map(|table| table.name.as_str()))?;
        expect_distinct("charts", self.charts.iter().map(Chart::name))?;
        expect_distinct("pictures", self.all_pictures().map(|picture| picture.name.as_str()))
    }

    fn make_folders(&self, folder: &Path) -> Result<(), ReportError> {
        let parts = [("charts", self.charts.is_empty()), ("pictures", self.all_pictures().next().is_none())];
        let used = parts.iter().filter(|(_, empty)| !empty).map(|(part, _)| folder.join(part));
        for path in std::iter::once(folder.to_path_buf()).chain(used) {
            fs::create_dir_all(&path).map_err(|source| ReportError::Io { path, source })?;
        }
        Ok(())
    }
}

fn expect_distinct<'a>(kind: &'static str, names: impl Iterator<Item = &'a str>) -> Result<(), ReportError> {
    let mut seen = HashSet::new();
    match names.map(slug).find(|name| !seen.insert(name.clone())) {
        Some(name) => Err(ReportError::DuplicateName { kind, name }),
        None => Ok(()),
    }
}

/// A chart as a file of its own: black on white.
fn standalone(svg: &str) -> String {
    let ink = " color=\"#1b1f24\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>";
    svg.replacen('>', ink, 1)
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    fs::write(path, bytes).map_err(|source| ReportError::Io { path: path.into(), source })
}
