//! Charts of accuracy over time.

use report::{Axis, Better, Point, Series, XyChart};

/// What one setting of a way to make views reaches, and the seconds of a view.
pub struct Reached {
    pub setting: String,
    pub view_s: f64,
    pub accuracy: f64,
}

/// A line for each way, with its settings beside its points, and the front of the best points.
pub fn over_time<'w>(
    (name, note): (String, &str),
    (accuracy, better): (Axis, Better),
    ways: impl IntoIterator<Item = (&'w str, Vec<Reached>)>,
) -> XyChart {
    let chart = XyChart::new(name, Axis::log("a view", "ms"), accuracy).with_front(Better::Low, better);
    let chart = XyChart { note: format!("{note} No point is better and faster than those on the grey line."), ..chart };
    let point = |of: Reached| Point::labelled(of.view_s * 1e3, of.accuracy, of.setting);
    ways.into_iter().fold(chart, |chart, (way, all)| chart.with(Series::line(way, all.into_iter().map(point))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_a_line_whose_points_have_their_milliseconds_and_settings() {
        let reached = |setting: &str, view_s, accuracy| Reached { setting: setting.to_owned(), view_s, accuracy };
        let ways =
            [("a", vec![reached("1", 0.002, 20.0), reached("4", 0.008, 26.0)]), ("b", vec![reached("", 0.1, 9.0)])];
        let chart = over_time(("PSNR".to_owned(), ""), (Axis::linear("PSNR", "dB"), Better::High), ways);
        let [a, b] = chart.series.as_slice() else { panic!("{chart:?}") };
        assert_eq!((a.name.as_str(), b.name.as_str()), ("a", "b"));
        assert_eq!(a.points, [Point::labelled(2.0, 20.0, "1"), Point::labelled(8.0, 26.0, "4")]);
        assert_eq!(b.points, [Point::labelled(100.0, 9.0, "")]);
    }
}
