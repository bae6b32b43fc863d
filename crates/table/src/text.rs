//! Tables as text, for the terminal.

use crate::cell::Cell;
use crate::table::{Column, Table};

impl Table {
    /// The name, then aligned columns: words to the left, numbers to the right.
    #[must_use]
    pub fn to_text(&self) -> String {
        let heads: Vec<String> = self.columns.iter().map(Column::heading).collect();
        let rows: Vec<Vec<String>> = self.rows.iter().map(|row| row.iter().map(Cell::display).collect()).collect();
        let width =
            |column: usize| rows.iter().chain([&heads]).map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..heads.len()).map(width).collect();
        let line = |row: &Vec<String>| {
            let cell = |(column, text): (usize, &String)| match self.is_numeric(column) {
                true => format!("{text:>0$}", widths[column]),
                false => format!("{text:<0$}", widths[column]),
            };
            row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ").trim_end().to_owned()
        };
        let lines = [&heads].into_iter().chain(&rows).map(line);
        format!("{}\n{}", self.name, lines.collect::<Vec<_>>().join("\n"))
    }

    fn is_numeric(&self, column: usize) -> bool {
        self.rows.iter().all(|row| row[column].is_numeric() || row[column] == Cell::Missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
