use app_core::live::{Record, Shown};

use super::beside::{Row, Visit};
use super::viewer::Watched;

fn record(shown_s: impl IntoIterator<Item = f64>, seconds: f64) -> Record {
    let shown = |shown_s| Shown {
        frame: 1,
        posed_s: shown_s,
        shown_s,
        plan_epoch: 1,
        set_index: 0,
        set_age_s: 0.0,
        stages_s: [0.0; 9],
        fallback: 0,
    };
    Record { shown: shown_s.into_iter().map(shown).collect(), posed: 0, error: None, seconds }
}

#[test]
fn frames_before_the_guest_do_not_count() {
    let steady = record((1..=100).map(|tenth| f64::from(tenth) * 0.1), 10.0);
    let watched = Watched::of(&steady, 5.0);
    assert!((watched.longest_gap_s - 0.1).abs() < 1e-9 && watched.shown_share > 0.98, "{watched:?}");
}

#[test]
fn a_viewer_that_sees_nothing_has_one_long_gap() {
    assert_eq!(Watched::of(&record([1.0], 10.0), 4.0), Watched { longest_gap_s: 6.0, shown_share: 0.0 });
    let late = Watched::of(&record([5.0], 10.0), 4.0);
    assert!((late.longest_gap_s - 5.0).abs() < 1e-9, "from the frame to the end");
}

#[test]
fn each_figure_has_its_own_median_and_the_worst_is_shown_beside_it() {
    let visit = |s: f64, share: f64| Visit {
        watched: Watched { longest_gap_s: s, shown_share: share },
        first_s: 3.0 * s,
        beside_s: 2.0 * s,
        alone_s: s,
    };
    let row = Row { policies: String::new(), visits: vec![visit(3.0, 0.1), visit(1.0, 0.9), visit(2.0, 0.5)] };
    let medians = [row.median(|visit| visit.watched.longest_gap_s), row.median(|visit| visit.watched.shown_share)];
    assert_eq!((medians, row.median(|visit| visit.beside_s)), ([2.0, 0.5], 4.0));
    assert_eq!((row.worst_gap_s(), row.worst_shown_share()), (3.0, 0.1));
}

#[test]
fn a_guest_that_could_not_be_measured_falls_short_of_every_bar() {
    let rows: Vec<_> = super::guests::GUESTS.iter().map(|guest| (guest, None)).collect();
    let section = super::report::section(&rows, String::new()).unwrap();
    assert!(section.checks.len() > 12);
    assert!(section.checks.iter().all(|check| check.outcome() == report::Outcome::FallsShort));
}
