//! Files of a report.

use std::collections::HashSet;
use std::fs;
use std::io::{self, Cursor, Write as _};
use std::path::Path;

use crate::chart::Palette;
use crate::check_text::checks_text;
use crate::error::ReportError;
use crate::html;
use crate::paths::{chart_path, picture_path, slug, table_path};
use crate::report::Report;
use crate::table::Table;

impl Report {
    /// Writes the report to a folder, which is made if need be: `report.json`, `index.html`, a CSV file a table,
    /// `charts/*.svg` and `pictures/*.png`.
    ///
    /// # Errors
    /// Parts do not fit together, names collide, or the folder cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ReportError> {
        // Everything is validated and drawn before the first file is written.
        self.validate()?;
        let palette =
            Palette::for_names(self.charts.iter().flat_map(|chart| &chart.series).map(|series| series.name.as_str()));
        let charts = self.charts.iter().map(|chart| chart.draw(&palette)).collect::<Result<Vec<_>, _>>()?;
        let page = html::page(self, &charts)?;
        for (chart, drawing) in self.charts.iter().zip(&charts) {
            write_file(&folder.join(chart_path(chart)), standalone(drawing).as_bytes())?;
        }
        for table in &self.tables {
            write_file(&folder.join(table_path(table)), &table.to_csv()?)?;
        }
        for picture in self.all_pictures() {
            let mut png = Cursor::new(Vec::new());
            picture.image.write_to(&mut png, image::ImageFormat::Png)?;
            write_file(&folder.join(picture_path(&picture.name)), png.get_ref())?;
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
        expect_distinct("charts", self.charts.iter().map(|chart| chart.name.as_str()))?;
        expect_distinct("pictures", self.all_pictures().map(|picture| picture.name.as_str()))
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
    let written = path.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(path, bytes));
    written.map_err(|source| ReportError::Io { path: path.into(), source })
}
