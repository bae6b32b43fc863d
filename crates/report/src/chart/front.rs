//! Pareto fronts: points that no other point beats in both directions.

use serde::{Deserialize, Serialize};

use super::Point;

/// The better end of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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
#[must_use]
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

#[cfg(test)]
mod tests {
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
}
