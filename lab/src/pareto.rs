//! Pareto fronts: points that no other point beats in both directions.

use report::{Axis, Point, Scale, XyChart};

/// The better end of an axis.
#[derive(Debug, Clone, Copy)]
pub enum Better {
    /// Lower values are better.
    Low,
    /// Higher values are better.
    High,
}

impl Better {
    /// The value, negated if need be, so that lower is better.
    fn cost(self, value: f64) -> f64 {
        match self {
            Self::Low => value,
            Self::High => -value,
        }
    }
}

/// Points that no other point beats, by x from the best. The first of equal points stays.
pub fn pareto_front<'a>(
    points: impl IntoIterator<Item = &'a Point>,
    [x_better, y_better]: [Better; 2],
) -> Vec<&'a Point> {
    let mut sorted: Vec<&Point> = points.into_iter().collect();
    sorted.sort_by(|a, b| {
        let by_x = x_better.cost(a.x).total_cmp(&x_better.cost(b.x));
        by_x.then(y_better.cost(a.y).total_cmp(&y_better.cost(b.y)))
    });
    let mut least = f64::INFINITY;
    sorted.retain(|point| {
        let y = y_better.cost(point.y);
        let is_better = y < least;
        least = least.min(y);
        is_better
    });
    sorted
}

/// The chart with a staircase along the front of all measured points that its axes can show. `better` has the better ends of
/// x and y.
pub fn with_front(mut chart: XyChart, better: [Better; 2]) -> XyChart {
    let mut shown = Vec::new();
    for series in &chart.series {
        let measured = series.points.iter().take(series.extrapolated_from.unwrap_or(usize::MAX));
        shown.extend(measured.filter(|point| is_shown(&chart.x, point.x) && is_shown(&chart.y, point.y)));
    }
    let front: Vec<Point> = pareto_front(shown, better).iter().map(|point| (point.x, point.y).into()).collect();
    chart.staircase = front;
    chart
}

fn is_shown(axis: &Axis, value: f64) -> bool {
    value.is_finite() && (axis.scale == Scale::Linear || value > 0.0)
}

#[cfg(test)]
mod tests {
    use report::Series;

    use super::*;

    fn front(points: &[(f64, f64)], better: [Better; 2]) -> Vec<(f64, f64)> {
        let points: Vec<Point> = points.iter().map(|&point| point.into()).collect();
        pareto_front(&points, better).into_iter().map(|point| (point.x, point.y)).collect()
    }

    #[test]
    fn dominated_points_are_not_on_the_front() {
        let points = [(1.0, 5.0), (2.0, 3.0), (3.0, 4.0), (4.0, 1.0), (1.0, 6.0), (2.0, 3.0)];
        assert_eq!(front(&points, [Better::Low, Better::Low]), [(1.0, 5.0), (2.0, 3.0), (4.0, 1.0)]);
    }

    #[test]
    fn more_can_be_better() {
        let points = [(1.0, 30.0), (2.0, 40.0), (3.0, 35.0)];
        assert_eq!(front(&points, [Better::Low, Better::High]), [(1.0, 30.0), (2.0, 40.0)]);
    }

    #[test]
    fn the_front_of_a_chart_passes_through_measured_points_that_are_shown() {
        let chart = XyChart::new("front", Axis::linear("time", "ms"), Axis::log("error", ""))
            .with(Series::line("a", [(1.0, 5.0), (2.0, 3.0)]).then_extrapolated([(3.0, 1.0)]))
            .with(Series::points("b", [(0.5, 0.0), (4.0, 2.0)]));
        let front = with_front(chart, [Better::Low, Better::Low]).staircase;
        assert_eq!(front, [(1.0, 5.0), (2.0, 3.0), (4.0, 2.0)].map(Point::from));
    }
}
