//! Tables of measured values: columns with units, rows of cells, written as text, CSV or Markdown.

#![cfg_attr(test, allow(clippy::unwrap_used))]

mod cell;
mod number;
mod table;

pub use cell::Cell;
pub use number::format_number;
pub use table::{Column, Table, TableError};
