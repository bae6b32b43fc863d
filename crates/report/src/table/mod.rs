//! Tables of measured values: columns with units, rows of cells, written as text or CSV.

mod cell;
mod rows;

pub use cell::Cell;
pub(crate) use cell::format_number;
pub(crate) use rows::heading;
pub use rows::{Column, RowColumn, Table};
