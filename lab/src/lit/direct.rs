//! Direct drawing at equal error.

use report::{Cell, Point};

use crate::compare::time_at;

/// Rows of direct drawing, as points of the time of a view in ms and of its FLIP.
pub struct DirectCurve(Vec<Point>);

impl DirectCurve {
    pub fn new(rows: impl IntoIterator<Item = Point>) -> Self {
        Self(rows.into_iter().collect())
    }

    /// The time with the fewest rays that reach a FLIP, interpolated; `None` where no row reaches it.
    pub fn ms_at(&self, flip: f64) -> Option<f64> {
        let points: Vec<Point> = self.0.iter().map(|row| (row.x, row.y.ln()).into()).collect();
        time_at(&points, flip.ln())
    }

    /// The FLIP that is reached in a time, interpolated; that of the fastest row where none is as fast.
    pub fn flip_at(&self, ms: f64) -> Option<f64> {
        let fastest = self.0.iter().min_by(|a, b| a.x.total_cmp(&b.x))?;
        let points: Vec<Point> = self.0.iter().map(|row| (row.y, row.x.ln()).into()).collect();
        time_at(&points, ms.max(fastest.x).ln())
    }

    /// As [`Self::ms_at`]; the time of the slowest row where none reaches the FLIP.
    pub fn least_ms_at(&self, flip: f64) -> f64 {
        self.ms_at(flip).unwrap_or_else(|| self.0.iter().map(|row| row.x).fold(f64::NAN, f64::max))
    }

    /// The time of direct drawing with a row's FLIP, over the row's; "> x" where no direct drawing reaches the FLIP.
    pub fn gain(&self, row: &Point) -> Cell {
        match self.ms_at(row.y) {
            Some(direct_ms) => Cell::from(direct_ms / row.x),
            None => format!("> {:.2}", self.least_ms_at(row.y) / row.x).into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the time halves the error.
    fn curve() -> DirectCurve {
        DirectCurve::new([(10.0, 0.08), (20.0, 0.04), (40.0, 0.02)].map(Point::from))
    }

    #[test]
    fn times_and_errors_are_interpolated_by_their_logarithms() {
        let between = curve().ms_at(0.08 / 2_f64.sqrt()).unwrap();
        assert!((between - 10.0 * 2_f64.sqrt()).abs() < 1e-9, "{between}");
        let between = curve().flip_at(20.0 * 2_f64.sqrt()).unwrap();
        assert!((between - 0.04 / 2_f64.sqrt()).abs() < 1e-9, "{between}");
    }

    #[test]
    fn beyond_its_ends_the_curve_gives_bounds() {
        assert_eq!(curve().ms_at(0.01), None);
        assert_eq!(curve().least_ms_at(0.01), 40.0);
        assert_eq!(curve().gain(&(4.0, 0.01).into()), Cell::from("> 10.00"));
        assert!((curve().flip_at(1.0).unwrap() - 0.08).abs() < 1e-9);
    }
}
