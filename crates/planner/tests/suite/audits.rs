//! The alarm and the interval of audits on made-up streams of errors.

use planner::{Audit, Budget, ViewErrors};

use super::made_up::Random;

const RUNS: u64 = 200;

fn budget() -> Budget {
    "flip 0.05".parse().unwrap()
}

/// Views with errors of this mean over the budget and this coefficient of variation.
fn audited(
    seed: u64,
    mean_over_budget: f64,
    variation: f64,
    foreground_ratio: f64,
    views: usize,
) -> (Audit, Option<usize>) {
    let mut random = Random(seed.wrapping_mul(0x5851_f42d_4c95_7f2d) + 1);
    let mut audit = Audit::new(budget(), foreground_ratio);
    let mut alarm = None;
    for view in 1..=views {
        let flip = (0.05 * mean_over_budget * random.factor(variation)).clamp(0.0, 1.0);
        audit.observe(&ViewErrors { foreground_ratio, flip, mean_square: 0.0 }, false);
        alarm = alarm.or(audit.is_alarmed().then_some(view));
    }
    (audit, alarm)
}

/// The number of views within which 95 % of all runs have found the broken promise.
fn found_within(mean_over_budget: f64, variation: f64, foreground_ratio: f64) -> usize {
    let alarms = (0..RUNS).map(|seed| audited(seed, mean_over_budget, variation, foreground_ratio, 2000).1);
    let mut alarms: Vec<usize> = alarms.map(|alarm| alarm.unwrap_or(usize::MAX)).collect();
    alarms.sort_unstable();
    alarms[RUNS as usize * 95 / 100]
}

#[test]
fn broken_promises_are_found_soon_and_kept_ones_hardly_ever_alarm() {
    for (mean, variation, foreground, most) in [
        (2.4, 0.3, 1.0, 16),
        (2.0, 0.3, 1.0, 24),
        (2.0, 0.6, 1.0, 35),
        (2.0, 0.6, 0.05, 35),
        (1.5, 0.3, 1.0, 45),
        (1.5, 0.6, 1.0, 90),
        (1.2, 0.3, 1.0, 400),
    ] {
        let found = found_within(mean, variation, foreground);
        println!("{mean} times the budget, variation {variation}, foreground {foreground}: found within {found} views");
        assert!(found <= most, "{mean} {variation} {foreground}: {found}, not {most}");
    }
    for variation in [0.1, 0.3, 0.6] {
        let false_alarms = (0..RUNS).filter(|&seed| audited(seed, 1.0, variation, 0.5, 1000).1.is_some()).count();
        println!("at the budget, variation {variation}: {false_alarms} of {RUNS} runs of 1,000 views alarm");
        assert!(false_alarms * 100 <= RUNS as usize * 10, "{variation}: {false_alarms}");
    }
    assert!((0..RUNS).all(|seed| audited(seed, 0.8, 0.6, 0.5, 1000).1.is_none()), "within the budget");
}

#[test]
fn the_interval_has_the_mean_and_narrows() {
    let mut right = 0;
    for seed in 0..RUNS {
        let (audit, _) = audited(seed, 0.8, 0.3, 0.5, 300);
        let interval = audit.interval().unwrap();
        right += u64::from((interval.low..=interval.high).contains(&0.04));
        assert!(interval.high - interval.low < 0.012, "{interval:?}");
        assert!((interval.mean - audit.mean_error().unwrap()).abs() < 1e-12);
    }
    assert!(right * 100 >= RUNS * 95, "{right}");
    let (few, _) = audited(1, 0.8, 0.3, 0.5, 15);
    assert!(few.interval().is_none() && few.mean_error().is_some());
    assert_eq!(Audit::new(budget(), 0.5).mean_error(), None);
}

#[test]
fn invalid_errors_and_views_of_nothing_say_nothing() {
    let mut audit = Audit::new(budget(), f64::NAN);
    for flip in [f64::NAN, 2.0, -1.0] {
        audit.observe(&ViewErrors { flip, ..ViewErrors::NONE }, false);
    }
    assert_eq!(audit.views(), 0);
    (0..100).for_each(|_| audit.observe(&ViewErrors { foreground_ratio: 0.0, ..ViewErrors::NONE }, true));
    assert!(!audit.is_alarmed() && audit.mean_error().is_none() && audit.views() == 100);
    let mut broken = Audit::new(budget(), 0.1);
    (0..100_000).for_each(|_| broken.observe(&ViewErrors { flip: 1.0, ..ViewErrors::NONE }, false));
    assert!(broken.is_alarmed() && broken.mean_error() == Some(1.0), "no overflow");
}
