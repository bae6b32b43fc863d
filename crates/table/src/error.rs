/// A table that cannot be made or written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum TableError {
    /// A row and the columns differ in number.
    #[error("row {row} of table {table:?} has {cells} cells, its columns are {columns}")]
    RowLength { table: String, row: usize, cells: usize, columns: usize },
    /// The CSV writer failed.
    #[error("cannot write a table: {0}")]
    Csv(#[from] csv::Error),
}
