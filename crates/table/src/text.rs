//! A report's table as text, for the terminal.

use study::{Cell, Table};

/// Aligned columns: words to the left, numbers to the right.
#[must_use]
pub fn text(table: &Table) -> String {
    let heads: Vec<String> = table.columns.iter().map(study::Column::heading).collect();
    let rows: Vec<Vec<String>> = table.rows.iter().map(|row| row.iter().map(Cell::display).collect()).collect();
    let width = |column: usize| rows.iter().chain([&heads]).map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..heads.len()).map(width).collect();
    let is_numeric =
        |column: usize| table.rows.iter().all(|row| row[column].is_numeric() || row[column] == Cell::Missing);
    let line = |row: &Vec<String>| {
        let cell = |(column, text): (usize, &String)| {
            if is_numeric(column) {
                format!("{text:>0$}", widths[column])
            } else {
                format!("{text:<0$}", widths[column])
            }
        };
        row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    let lines = [&heads].into_iter().chain(&rows).map(line);
    format!("{}\n{}", table.name, lines.collect::<Vec<_>>().join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let mut table = Table::new("Times", &[("method", ""), ("time", "ms")]);
        table.push(["direct".into(), 60.0.into()]).unwrap();
        table.push(["joint_carve".into(), 3.25.into()]).unwrap();
        let lines: Vec<String> = text(&table).lines().map(str::to_owned).collect();
        assert_eq!(lines.len(), 4);
        assert!(lines[1..].iter().all(|line| line.chars().count() == lines[1].chars().count()), "{lines:?}");
    }
}
