//! Tables: columns with units, rows of cells.

use serde::{Deserialize, Serialize};

use crate::{ReportError, format_number};

/// One value of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// Not measured, not finite or not applicable: `null`, an empty CSV field.
    Missing,
    /// Yes or no.
    Flag(bool),
    /// A count.
    Integer(i64),
    /// A measure; always finite.
    Number(f64),
    /// Words.
    Text(String),
}

impl Cell {
    /// As in an HTML table: numbers to four significant digits.
    #[must_use]
    pub fn display(&self) -> String {
        match self {
            Self::Missing => "–".into(),
            Self::Flag(flag) => if *flag { "yes" } else { "no" }.into(),
            Self::Integer(integer) => integer.to_string(),
            Self::Number(number) => format_number(*number),
            Self::Text(text) => text.clone(),
        }
    }

    /// As in a CSV file: numbers in full.
    #[must_use]
    pub fn full(&self) -> String {
        match self {
            Self::Missing => String::new(),
            Self::Flag(flag) => flag.to_string(),
            Self::Number(number) => number.to_string(),
            Self::Integer(_) | Self::Text(_) => self.display(),
        }
    }

    /// Whether it reads best aligned right.
    #[must_use]
    pub fn is_numeric(&self) -> bool {
        matches!(self, Self::Integer(_) | Self::Number(_))
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        if number.is_finite() { Self::Number(number) } else { Self::Missing }
    }
}

impl From<f32> for Cell {
    fn from(number: f32) -> Self {
        f64::from(number).into()
    }
}

impl From<i64> for Cell {
    fn from(integer: i64) -> Self {
        Self::Integer(integer)
    }
}

impl From<u32> for Cell {
    fn from(integer: u32) -> Self {
        Self::Integer(integer.into())
    }
}

impl From<usize> for Cell {
    fn from(integer: usize) -> Self {
        i64::try_from(integer).map_or(Self::Number(integer as f64), Self::Integer)
    }
}

impl From<bool> for Cell {
    fn from(flag: bool) -> Self {
        Self::Flag(flag)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Missing, Into::into)
    }
}

/// What a column holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// Its heading.
    pub name: String,
    /// `ms`, `dB`, `px`…; empty for none.
    pub unit: String,
}

impl Column {
    /// A column with a unit, or with `""`.
    #[must_use]
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// `name (unit)`.
    #[must_use]
    pub fn heading(&self) -> String {
        match self.unit.is_empty() {
            true => self.name.clone(),
            false => format!("{} ({})", self.name, self.unit),
        }
    }
}

/// A table, written as `{slug(name)}.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// What it is about.
    pub name: String,
    /// Left to right.
    pub columns: Vec<Column>,
    /// Top to bottom, one cell a column each.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table of `(heading, unit)` columns.
    #[must_use]
    pub fn new(name: impl Into<String>, columns: &[(&str, &str)]) -> Self {
        let columns = columns.iter().map(|&(name, unit)| Column::new(name, unit)).collect();
        Self { name: name.into(), columns, rows: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Errors
    /// Not one cell a column.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) -> Result<(), ReportError> {
        self.rows.push(row.into_iter().collect());
        self.validate()
    }

    /// Checks that every row has one cell a column.
    pub(crate) fn validate(&self) -> Result<(), ReportError> {
        let columns = self.columns.len();
        match self.rows.iter().enumerate().find(|(_, row)| row.len() != columns) {
            Some((row, cells)) => {
                Err(ReportError::RowLength { table: self.name.clone(), row, cells: cells.len(), columns })
            }
            None => Ok(()),
        }
    }

    /// The table with a heading line, quoted as RFC 4180 wants it.
    ///
    /// # Errors
    /// When a row has more or fewer cells than there are columns.
    pub fn to_csv(&self) -> Result<Vec<u8>, ReportError> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(self.columns.iter().map(Column::heading))?;
        for row in &self.rows {
            writer.write_record(row.iter().map(Cell::full))?;
        }
        writer.into_inner().map_err(|error| csv::Error::from(error.into_error()).into())
    }

    /// As it stands in a Markdown page, rounded as on paper.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let heads = line(self.columns.iter().map(Column::heading).collect());
        let rule = format!("|{}\n", "---|".repeat(self.columns.len()));
        let rows: String = self.rows.iter().map(|row| line(row.iter().map(Cell::display).collect())).collect();
        format!("**{}**\n\n{heads}{rule}{rows}", self.name)
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
    fn tables_read_as_markdown() {
        let mut table = Table::new("Times", &[("P", ""), ("T", "s")]);
        table.push([2_u32.into(), 1.5.into()]).unwrap();
        assert_eq!(table.to_markdown(), "**Times**\n\n| P | T (s) |\n|---|---|\n| 2 | 1.5 |\n");
    }

    #[test]
    fn a_short_row_is_refused() {
        let mut table = Table::new("costs", &[("what", ""), ("time", "ms")]);
        assert!(matches!(table.push([1_u32.into()]), Err(ReportError::RowLength { cells: 1, columns: 2, .. })));
    }

    #[test]
    fn cells_survive_json() {
        let cells = [Cell::Missing, true.into(), 3_u32.into(), 0.5.into(), 2.0.into(), "x".into(), None::<f64>.into()];
        let text = serde_json::to_string(&cells).unwrap();
        assert_eq!(text, r#"[null,true,3,0.5,2.0,"x",null]"#);
        assert_eq!(serde_json::from_str::<Vec<Cell>>(&text).unwrap(), cells);
    }
}
