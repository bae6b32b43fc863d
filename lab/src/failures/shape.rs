//! Shapes of curves: a closed set, and the comparison of measured values with them.

use Shape::{Bounded, EqualAt, FallsThenFlat, Monotone, Plateau};

/// The least change of a strict shape, as a share of its first value.
const LEAST_CHANGE_SHARE: f64 = 0.2;
/// The share of a curve's values, from the end, that is flat where it falls and then is flat; two values at least.
const FLAT_SHARE: f64 = 0.25;

/// The direction of a monotone curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    Up,
    Down,
}

/// The shape that values must have over rising x. Tolerances and changes are in the units of y. No shape has values that
/// are not finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Falls by `least_fall` or more, and by a fifth of its first value; then the last quarter stays within the tolerance.
    FallsThenFlat { least_fall: f64, tolerance: f64 },
    /// Never turns by more than the tolerance. With a `least_change` it changes by as much, and by a fifth of its first
    /// value; with 0 it may stay where it is.
    Monotone { direction: Direction, least_change: f64, tolerance: f64 },
    /// Every value lies within these bounds.
    Bounded { least: f64, most: f64 },
    /// All values lie within a range of this tolerance.
    Plateau { tolerance: f64 },
    /// The value at an x is known.
    EqualAt { x: f64, y: f64, tolerance: f64 },
}

/// A shape that values do not have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Violation {
    #[error("{xs} values of x, {ys} of y; two at least must match")]
    Lengths { xs: usize, ys: usize },
    #[error("x does not rise at {x}")]
    Order { x: f64 },
    #[error("not finite at x = {x}")]
    NotFinite { x: f64 },
    #[error("turns from {from} to {to} at x = {x}")]
    Turns { x: f64, from: f64, to: f64 },
    #[error("changes by {change}, not by {least}")]
    ChangesTooLittle { change: f64, least: f64 },
    #[error("the end is not flat: its values are {range} apart, not within {tolerance}")]
    NotFlat { range: f64, tolerance: f64 },
    #[error("{y} at x = {x} is not within {least} to {most}")]
    Outside { x: f64, y: f64, least: f64, most: f64 },
    #[error("nothing is measured at x = {x}")]
    NotMeasured { x: f64 },
}

impl Shape {
    /// A curve that rises by `least_change` or more.
    pub const fn rises(least_change: f64, tolerance: f64) -> Self {
        Monotone { direction: Direction::Up, least_change, tolerance }
    }

    /// A curve that falls by `least_change` or more.
    pub const fn falls(least_change: f64, tolerance: f64) -> Self {
        Monotone { direction: Direction::Down, least_change, tolerance }
    }

    /// Compares values with the shape.
    ///
    /// # Errors
    /// The first violation.
    pub fn check(self, x: &[f64], y: &[f64]) -> Result<(), Violation> {
        check_points(x, y)?;
        match self {
            Bounded { least, most } => check_bounds(x, y, [least, most]),
            Plateau { tolerance } => check_range(y, tolerance),
            EqualAt { x: at, y: expected, tolerance } => {
                check_at(x, y, at, [expected - tolerance, expected + tolerance])
            }
            Monotone { direction, least_change, tolerance } => check_monotone(x, y, direction, least_change, tolerance),
            FallsThenFlat { least_fall, tolerance } => {
                let flat = ((y.len() as f64 * FLAT_SHARE).ceil() as usize).max(2);
                check_monotone(x, y, Direction::Down, least_fall, tolerance)?;
                check_range(&y[y.len() - flat..], tolerance)
            }
        }
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            FallsThenFlat { least_fall, tolerance } => {
                write!(f, "falls by {least_fall} or more, then flat within {tolerance}")
            }
            Monotone { direction, least_change, tolerance } => {
                let verb = if *direction == Direction::Up { "rises" } else { "falls" };
                match *least_change > 0.0 {
                    true => write!(f, "{verb} by {least_change} or more, turning by {tolerance} at most"),
                    false => write!(f, "{verb} or stays, turning by {tolerance} at most"),
                }
            }
            Bounded { least, most } => write!(f, "within {least} to {most}"),
            Plateau { tolerance } => write!(f, "flat within {tolerance}"),
            EqualAt { x, y, tolerance } => write!(f, "{y} within {tolerance} at x = {x}"),
        }
    }
}

fn check_points(x: &[f64], y: &[f64]) -> Result<(), Violation> {
    if x.len() != y.len() || x.len() < 2 {
        return Err(Violation::Lengths { xs: x.len(), ys: y.len() });
    }
    // NaN rises to nothing.
    if let Some(pair) = x.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less)) {
        return Err(Violation::Order { x: pair[1] });
    }
    let bad = x.iter().zip(y).find(|(_, y)| !y.is_finite());
    bad.map_or(Ok(()), |(&x, _)| Err(Violation::NotFinite { x }))
}

fn check_bounds(x: &[f64], y: &[f64], [least, most]: [f64; 2]) -> Result<(), Violation> {
    let outside = x.iter().zip(y).find(|(_, y)| !(least..=most).contains(*y));
    outside.map_or(Ok(()), |(&x, &y)| Err(Violation::Outside { x, y, least, most }))
}

fn check_range(y: &[f64], tolerance: f64) -> Result<(), Violation> {
    let [least, most] =
        [y.iter().copied().fold(f64::INFINITY, f64::min), y.iter().copied().fold(f64::NEG_INFINITY, f64::max)];
    let range = most - least;
    if range <= tolerance { Ok(()) } else { Err(Violation::NotFlat { range, tolerance }) }
}

fn check_at(x: &[f64], y: &[f64], at: f64, bounds: [f64; 2]) -> Result<(), Violation> {
    let place = x.iter().position(|x| (x - at).abs() <= 1e-9 * at.abs()).ok_or(Violation::NotMeasured { x: at })?;
    check_bounds(&x[place..=place], &y[place..=place], bounds)
}

fn check_monotone(
    x: &[f64],
    y: &[f64],
    direction: Direction,
    least_change: f64,
    tolerance: f64,
) -> Result<(), Violation> {
    let sign = if direction == Direction::Up { 1.0 } else { -1.0 };
    let turn = x[1..].iter().zip(y.windows(2)).find(|(_, pair)| sign * (pair[1] - pair[0]) < -tolerance);
    if let Some((&x, pair)) = turn {
        return Err(Violation::Turns { x, from: pair[0], to: pair[1] });
    }
    let change = sign * (y[y.len() - 1] - y[0]);
    let least = match least_change > 0.0 {
        true => least_change.max(LEAST_CHANGE_SHARE * y[0].abs()),
        false => -tolerance,
    };
    if change >= least { Ok(()) } else { Err(Violation::ChangesTooLittle { change, least }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: [f64; 5] = [1.0, 2.0, 3.0, 4.0, 5.0];
    const FALLING: [f64; 5] = [5.0, 3.0, 2.0, 1.0, 1.0];
    const RISING: [f64; 5] = [1.0, 1.0, 2.0, 3.0, 5.0];
    const HILL: [f64; 5] = [1.0, 3.0, 5.0, 3.0, 1.0];
    const FLAT: [f64; 5] = [2.0; 5];
    const FINITE: Shape = Bounded { least: f64::NEG_INFINITY, most: f64::INFINITY };

    #[test]
    fn values_of_a_shape_pass() {
        let flat_end = FallsThenFlat { least_fall: 3.0, tolerance: 0.1 };
        let good: [(Shape, [f64; 5]); 7] = [
            (flat_end, FALLING),
            (Shape::falls(4.0, 0.0), FALLING),
            (Shape::rises(4.0, 0.0), RISING),
            (Shape::rises(0.0, 0.0), FLAT),
            (Bounded { least: 1.0, most: 5.0 }, HILL),
            (Plateau { tolerance: 0.0 }, FLAT),
            (EqualAt { x: 3.0, y: 5.0, tolerance: 0.0 }, HILL),
        ];
        for (shape, y) in good {
            assert_eq!(shape.check(&X, &y), Ok(()), "{shape}");
        }
    }

    #[test]
    fn a_violation_of_every_shape_is_seen() {
        let flat_end = FallsThenFlat { least_fall: 3.0, tolerance: 0.1 };
        type Case = (Shape, [f64; 5], fn(&Violation) -> bool);
        let bad: [Case; 11] = [
            (flat_end, RISING, |v| matches!(v, Violation::Turns { .. })),
            (flat_end, [5.0, 4.0, 3.0, 2.0, 1.0], |v| matches!(v, Violation::NotFlat { .. })),
            (flat_end, FLAT, |v| matches!(v, Violation::ChangesTooLittle { .. })),
            (Shape::falls(4.1, 0.0), FALLING, |v| matches!(v, Violation::ChangesTooLittle { .. })),
            (Shape::falls(1.0, 0.0), RISING, |v| matches!(v, Violation::Turns { x, .. } if *x == 3.0)),
            (Shape::rises(0.0, 0.5), FALLING, |v| matches!(v, Violation::Turns { .. })),
            (Shape::rises(0.1, 0.0), FLAT, |v| matches!(v, Violation::ChangesTooLittle { .. })),
            (Bounded { least: 1.0, most: 4.9 }, HILL, |v| matches!(v, Violation::Outside { x, .. } if *x == 3.0)),
            (Plateau { tolerance: 3.9 }, HILL, |v| matches!(v, Violation::NotFlat { .. })),
            (EqualAt { x: 3.0, y: 4.0, tolerance: 0.9 }, HILL, |v| matches!(v, Violation::Outside { .. })),
            (EqualAt { x: 9.0, y: 4.0, tolerance: 0.9 }, HILL, |v| matches!(v, Violation::NotMeasured { .. })),
        ];
        for (shape, y, is_expected) in bad {
            let violation = shape.check(&X, &y).unwrap_err();
            assert!(is_expected(&violation), "{shape}: {violation}");
        }
    }

    #[test]
    fn no_shape_has_values_that_are_not_numbers() {
        let shapes = [
            FallsThenFlat { least_fall: 1.0, tolerance: 9.0 },
            Shape::rises(0.0, 9.0),
            Bounded { least: f64::NEG_INFINITY, most: f64::INFINITY },
            Plateau { tolerance: f64::INFINITY },
            EqualAt { x: 1.0, y: 1.0, tolerance: 1.0 },
        ];
        for (shape, bad) in shapes.into_iter().flat_map(|shape| [(shape, f64::NAN), (shape, f64::INFINITY)]) {
            let y = [1.0, 3.0, 5.0, bad, 1.0];
            assert_eq!(shape.check(&X, &y), Err(Violation::NotFinite { x: 4.0 }), "{shape}");
        }
    }

    #[test]
    fn curves_without_order_or_length_are_refused() {
        assert!(matches!(FINITE.check(&X, &FLAT[1..]), Err(Violation::Lengths { xs: 5, ys: 4 })));
        assert!(matches!(FINITE.check(&[1.0], &[1.0]), Err(Violation::Lengths { .. })));
        assert_eq!(FINITE.check(&[1.0, 1.0], &[1.0, 2.0]), Err(Violation::Order { x: 1.0 }));
        assert!(matches!(FINITE.check(&[1.0, f64::NAN], &[1.0, 2.0]), Err(Violation::Order { .. })));
    }

    #[test]
    fn a_fifth_of_the_first_value_is_the_least_change_of_a_strict_shape() {
        let y = [100.0, 95.0, 90.0, 85.0, 81.0];
        assert!(
            matches!(Shape::falls(1.0, 0.0).check(&X, &y), Err(Violation::ChangesTooLittle { least, .. }) if least == 20.0)
        );
    }
}
