//! BD-time: the mean ratio of the times of two fronts, over the errors that both reach (Bjøntegaard 2001, "Calculation of
//! Average PSNR Differences between RD-curves", VCEG-M33; interpolation as in the JCT-VC's sheets).

use report::Point;

use super::pchip::Pchip;
use crate::pareto::{Better, pareto_front};

/// The times of the new points over those of the old, less 1: −0.1 is 10 % less. Points have the time as x, above 0, and the
/// error as y; those that are not on their front do not count. `None` where a front has fewer than two points, or the
/// fronts have no range of errors in common.
pub fn bd_time(old: &[Point], new: &[Point]) -> Option<f64> {
    let [old, new] = [curve(old)?, curve(new)?];
    let [[old_from, old_to], [new_from, new_to]] = [old.range(), new.range()];
    let from = old_from.max(new_from);
    let to = old_to.min(new_to);
    (from < to).then(|| (new.mean(from, to) - old.mean(from, to)).exp() - 1.0)
}

/// The least time at which an error is reached, between points with the same interpolation as [`bd_time`]; `None` where the
/// front has fewer than two points, or none that reaches the error.
pub fn time_at(points: &[Point], error: f64) -> Option<f64> {
    let curve = curve(points)?;
    let [least, greatest] = curve.range();
    (error >= least).then(|| curve.at(error.min(greatest)).exp())
}

/// The logarithm of the time over the error.
fn curve(points: &[Point]) -> Option<Pchip> {
    let front = pareto_front(points, [Better::Low, Better::Low]);
    let by_error: Vec<(f64, f64)> = front.iter().rev().map(|point| (point.y, point.x.ln())).collect();
    (by_error.len() > 1).then(|| Pchip::new(&by_error))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(times: &[f64], errors: &[f64]) -> Vec<Point> {
        times.iter().zip(errors).map(|(&time, &error)| (time, error).into()).collect()
    }

    /// The values are those of the Python package `bjontegaard` 1.3: `bd_rate` with `pchip`, the times as rates and the
    /// negated errors as distortions.
    #[test]
    fn fixtures_have_the_values_of_an_independent_implementation() {
        let fixtures: [([&[f64]; 4], f64); 3] = [
            (
                [
                    &[1.9, 2.4, 3.1, 4.4, 7.9],
                    &[0.081, 0.0664, 0.0571, 0.0502, 0.0463],
                    &[1.7, 2.1, 2.9, 4.0, 7.0],
                    &[0.0805, 0.067, 0.0569, 0.0504, 0.046],
                ],
                -9.991_114_815_619_417,
            ),
            (
                [
                    &[2.0, 3.0, 5.0, 8.0, 13.0, 21.0],
                    &[0.12, 0.09, 0.071, 0.06, 0.0555, 0.054],
                    &[2.6, 3.1, 4.7, 9.0, 12.0, 30.0],
                    &[0.1, 0.082, 0.07, 0.0575, 0.056, 0.0521],
                ],
                -8.444_888_234_251_879,
            ),
            (
                [&[1.0, 2.0, 4.0, 8.0], &[0.2, 0.15, 0.11, 0.1], &[3.0, 4.0, 6.5, 9.0], &[0.13, 0.1, 0.08, 0.075]],
                -11.129_677_989_894_448,
            ),
        ];
        for ([old_times, old_errors, new_times, new_errors], percent) in fixtures {
            let found = 100.0 * bd_time(&points(old_times, old_errors), &points(new_times, new_errors)).unwrap();
            assert!((found - percent).abs() < 1e-6, "{found}, not {percent}");
        }
    }

    #[test]
    fn equal_fronts_have_no_difference_and_twice_the_time_is_a_hundred_per_cent() {
        let old = points(&[1.0, 2.0, 5.0], &[0.3, 0.2, 0.1]);
        let slower = points(&[2.0, 4.0, 10.0], &[0.3, 0.2, 0.1]);
        assert_eq!(bd_time(&old, &old), Some(0.0));
        assert!((bd_time(&old, &slower).unwrap() - 1.0).abs() < 1e-12);
        assert!((bd_time(&slower, &old).unwrap() + 0.5).abs() < 1e-12);
        let beaten = [old.clone(), points(&[9.0], &[0.25])].concat();
        assert_eq!(bd_time(&beaten, &old), Some(0.0), "a point that another beats does not count");
    }

    #[test]
    fn an_error_is_reached_between_the_times_of_its_neighbours() {
        let front = points(&[1.0, 2.0, 4.0], &[0.4, 0.2, 0.1]);
        let between = time_at(&front, 0.15).unwrap();
        assert!((2.3..3.3).contains(&between), "{between}");
        assert!((time_at(&front, 0.2).unwrap() - 2.0).abs() < 1e-12);
        assert!((time_at(&front, 0.5).unwrap() - 1.0).abs() < 1e-12, "the first point is better already");
        assert_eq!(time_at(&front, 0.05), None);
    }

    #[test]
    fn fronts_without_a_common_range_are_not_comparable() {
        let old = points(&[1.0, 2.0], &[0.3, 0.2]);
        assert_eq!(bd_time(&old, &points(&[1.0, 2.0], &[0.1, 0.05])), None);
        assert_eq!(bd_time(&old, &points(&[1.0], &[0.25])), None, "a single point");
        assert_eq!(bd_time(&old, &[]), None);
    }
}
