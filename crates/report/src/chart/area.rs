//! Areas that charts draw in.

use plotters::coord::Shift;
use plotters::prelude::*;

/// Part of a drawing.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The text of an error of the chart library, which borrows the drawing.
pub(super) fn message(error: impl std::error::Error) -> String {
    error.to_string()
}
