//! Tables of rows, by columns that say what stands in their cells.

use report::{Cell, ReportError, Table};

/// A column: its name, its unit, and its cell in a row.
pub type Column<'n, R> = (&'n str, &'n str, fn(&R) -> Cell);

/// A table of rows.
///
/// # Errors
/// A cell cannot be in a table.
pub fn table<R>(name: impl Into<String>, rows: &[R], columns: &[Column<'_, R>]) -> Result<Table, ReportError> {
    let heads: Vec<_> = columns.iter().map(|&(name, unit, _)| (name, unit)).collect();
    let mut table = Table::new(name, &heads);
    for row in rows {
        table.push(columns.iter().map(|(.., cell)| cell(row)))?;
    }
    Ok(table)
}
