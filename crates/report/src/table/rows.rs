//! Tables: columns with units, rows of cells.

use serde::{Deserialize, Serialize};

use super::cell::Cell;
use crate::ReportError;

/// A column.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// The heading.
    pub name: String,
    /// The unit, such as `ms`, `dB` or `px`; empty for none.
    pub unit: String,
}

impl Column {
    /// `name (unit)`.
    #[must_use]
    pub fn heading(&self) -> String {
        heading(&self.name, &self.unit)
    }
}

/// `name (unit)`, or the name alone where there is no unit.
pub(crate) fn heading(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") }
}

/// A column of a table of rows: its name, its unit, and its cell in a row.
pub type RowColumn<'n, R> = (&'n str, &'n str, fn(&R) -> Cell);

/// A table, written as `{slug(name)}.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// The title.
    pub name: String,
    /// Columns, left to right.
    pub columns: Vec<Column>,
    /// Rows, top to bottom, each with one cell a column.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table of `(heading, unit)` columns.
    #[must_use]
    pub fn new(name: impl Into<String>, columns: &[(&str, &str)]) -> Self {
        let columns = columns.iter().map(|&(name, unit)| Column { name: name.into(), unit: unit.into() });
        Self { name: name.into(), columns: columns.collect(), rows: Vec::new() }
    }

    /// A table of rows.
    #[must_use]
    pub fn of_rows<R>(name: impl Into<String>, rows: &[R], columns: &[RowColumn<'_, R>]) -> Self {
        let heads: Vec<(&str, &str)> = columns.iter().map(|&(name, unit, _)| (name, unit)).collect();
        let rows = rows.iter().map(|row| columns.iter().map(|(.., cell)| cell(row)).collect());
        Self { rows: rows.collect(), ..Self::new(name, &heads) }
    }

    /// Adds a row.
    ///
    /// # Errors
    /// Cells and columns differ in number.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) -> Result<(), ReportError> {
        self.rows.push(row.into_iter().collect());
        self.validate()
    }

    /// Checks that every row has one cell a column.
    pub fn validate(&self) -> Result<(), ReportError> {
        let columns = self.columns.len();
        match self.rows.iter().enumerate().find(|(_, row)| row.len() != columns) {
            Some((row, cells)) => {
                Err(ReportError::RowLength { table: self.name.clone(), row, cells: cells.len(), columns })
            }
            None => Ok(()),
        }
    }

    /// The table as CSV with a heading line, quoted by RFC 4180.
    ///
    /// # Errors
    /// Cells and columns differ in number.
    pub fn to_csv(&self) -> Result<Vec<u8>, ReportError> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(self.columns.iter().map(Column::heading))?;
        for row in &self.rows {
            writer.write_record(row.iter().map(Cell::full))?;
        }
        writer.into_inner().map_err(|error| csv::Error::from(error.into_error()).into())
    }

    /// The name, then aligned columns: words to the left, numbers to the right.
    #[must_use]
    pub fn to_text(&self) -> String {
        let heads: Vec<String> = self.columns.iter().map(Column::heading).collect();
        let rows: Vec<Vec<String>> = self.rows.iter().map(|row| row.iter().map(Cell::display).collect()).collect();
        let columns = (0..heads.len()).map(|column| {
            let width = rows.iter().chain([&heads]).map(|row| row[column].chars().count()).max().unwrap_or(0);
            let is_number = self.rows.iter().all(|row| row[column].is_numeric() || row[column] == Cell::Missing);
            (width, is_number)
        });
        let columns: Vec<(usize, bool)> = columns.collect();
        let lines = [&heads].into_iter().chain(&rows).map(|row| {
            let cells = row.iter().zip(&columns).map(|(text, &(width, is_number))| {
                if is_number { format!("{text:>width$}") } else { format!("{text:<width$}") }
            });
            cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        });
        format!("{}\n{}", self.name, lines.collect::<Vec<_>>().join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_is_quoted_and_in_full() {
        let mut table = Table::new("costs", &[("what", ""), ("time", "ms")]);
        table.push(["a, \"b\"".into(), 1.234_567_8.into()]).unwrap();
        table.push(["none".into(), f64::NAN.into()]).unwrap();
        let text = String::from_utf8(table.to_csv().unwrap()).unwrap();
        assert_eq!(text, "what,time (ms)\n\"a, \"\"b\"\"\",1.2345678\nnone,\n");
    }

    #[test]
    fn a_row_with_too_few_cells_is_refused() {
        let mut table = Table::new("costs", &[("what", ""), ("time", "ms")]);
        assert!(matches!(table.push([1_u32.into()]), Err(ReportError::RowLength { cells: 1, columns: 2, .. })));
    }

    #[test]
    fn columns_of_text_are_aligned() {
        let mut table = Table::new("Times", &[("method", ""), ("time", "ms")]);
        table.push(["direct".into(), 60.0.into()]).unwrap();
        table.push(["joint_carve".into(), 3.25.into()]).unwrap();
        let lines: Vec<String> = table.to_text().lines().map(str::to_owned).collect();
        assert_eq!(lines.len(), 4);
        assert!(lines[1..].iter().all(|line| line.chars().count() == lines[1].chars().count()), "{lines:?}");
    }
}
