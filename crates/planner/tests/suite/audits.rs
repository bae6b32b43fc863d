//! The audit on streams of made-up errors.

use planner::{Audit, Budget, ErrorTerm, ViewErrors};

use crate::random::Random;

const RUNS: u64 = 200;

fn term(text: &str) -> ErrorTerm {
    text.parse::<Budget>().unwrap().error().unwrap()
}

fn view(foreground_ratio: f64, flip: f64) -> ViewErrors {
    let flip = flip.min(1.0);
    ViewErrors { foreground_ratio, flip, flip_whole: flip * foreground_ratio, mean_square: 0.0, disoccluded_ratio: 0.0 }
}

/// A stream of views: gamma errors of a mean, in times the budget of 0.05, and shares of foreground around a mean.
#[derive(Debug, Clone, Copy)]
struct Stream {
    times: f64,
    variation: f64,
    foreground_ratio: f64,
}

impl Stream {
    fn view(&self, random: &mut Random) -> ViewErrors {
        let foreground_ratio = (self.foreground_ratio * random.between(0.5, 1.5)).min(1.0);
        view(foreground_ratio, 0.05 * self.times * random.gamma(self.variation))
    }

    /// The views until an alarm of each run, at most `most`.
    fn alarms(&self, most: u64) -> Vec<u64> {
        let run = |seed: u64| {
            let mut random = Random(seed + 1);
            let mut audit = Audit::new(term("flip 0.05"), self.foreground_ratio);
            let observe = |_: &u64| {
                audit.observe(&self.view(&mut random));
                audit.is_alarmed()
            };
            (1..=most).find(observe).unwrap_or(most + 1)
        };
        let mut alarms: Vec<u64> = (0..RUNS).map(run).collect();
        alarms.sort_unstable();
        alarms
    }
}

/// The views within which 95 % of the runs are alarmed.
fn most_of(alarms: &[u64]) -> u64 {
    alarms[alarms.len() * 95 / 100 - 1]
}

#[test]
fn broken_promises_are_found() {
    for variation in [0.1, 0.3, 0.6] {
        let found = [2.0, 1.5].map(|times| most_of(&Stream { times, variation, foreground_ratio: 1.0 }.alarms(400)));
        println!("v {variation}: 2 and 1.5 times the budget found in 95 % of runs within {found:?} audits");
        assert!(found[0] <= 60 && found[1] <= 140, "{variation}: {found:?}");
    }
    // Parts of views vary more than views.
    let cells = most_of(&Stream { times: 2.0, variation: 1.5, foreground_ratio: 1.0 }.alarms(400));
    println!("cells, v 1.5: twice the budget within {cells} audits");
    assert!(cells <= 250, "{cells}");
}

/// Models that fill little of a picture move y little; bets on them are as much higher.
#[test]
fn broken_promises_of_small_models_are_found_as_fast() {
    for foreground_ratio in [0.5, 0.2, 0.1, 0.02] {
        let found = most_of(&Stream { times: 2.0, variation: 0.6, foreground_ratio }.alarms(1_000));
        println!("foreground {foreground_ratio}: twice the budget within {found} audits");
        assert!(found <= 60, "{foreground_ratio}: {found}");
    }
}

/// Of a model that fills a share of the view, most squares show all or nothing.
#[test]
fn broken_promises_of_views_that_are_compared_by_squares_are_found() {
    for (share, most) in [(1.0, 80), (0.3, 250), (0.1, 700)] {
        let found = |seed: u64| {
            let mut random = Random(seed + 1);
            let mut audit = Audit::new(term("flip 0.05"), 1.0);
            (1..=1_000_u64).find(|_| {
                let foreground_ratio = if random.unit() < share { random.between(0.5, 1.0) } else { 0.0 };
                audit.observe(&view(foreground_ratio, 0.1 * random.gamma(1.0)));
                audit.is_alarmed()
            })
        };
        let mut found: Vec<u64> = (0..RUNS).map(|seed| found(seed).unwrap_or(1_001)).collect();
        found.sort_unstable();
        println!("squares, {share} with a surface, v 1: twice the budget within {} audits", most_of(&found));
        assert!(most_of(&found) <= most, "{share}: {}", most_of(&found));
    }
}

/// A certificate's views may show far less foreground than a viewer's, or more; views differ, too.
#[test]
fn kept_promises_of_views_unlike_those_of_the_certificate_are_rarely_alarmed() {
    for [certified, shown] in [[0.02, 0.3], [0.02, 0.9], [0.9, 0.05]] {
        let alarmed = |seed: &u64| {
            let mut random = Random(*seed);
            let mut audit = Audit::new(term("flip 0.05"), certified);
            (0..1_000).any(|_| {
                // Most of the views show little.
                let foreground_ratio = shown * random.unit().powi(4);
                audit.observe(&view(foreground_ratio, 0.05 * random.gamma(0.5)));
                audit.is_alarmed()
            })
        };
        let alarmed = (0..RUNS).filter(alarmed).count();
        println!("foreground {certified} certified, up to {shown} shown: {alarmed} of {RUNS} runs at the budget alarm");
        assert!(alarmed as f64 <= 0.04 * RUNS as f64, "{certified}, {shown}: {alarmed}");
    }
}

#[test]
fn kept_promises_are_rarely_alarmed() {
    for (variation, foreground_ratio) in [(0.1, 1.0), (0.3, 0.3), (0.6, 1.0), (0.6, 0.2)] {
        let alarms = Stream { times: 1.0, variation, foreground_ratio }.alarms(1_000);
        let alarmed = alarms.iter().filter(|views| **views <= 1_000).count();
        println!("v {variation}, foreground {foreground_ratio}: {alarmed} of {RUNS} runs of 1,000 at the budget alarm");
        assert!(alarmed as f64 <= 0.04 * RUNS as f64, "{variation}: {alarmed}");
    }
}

/// A promise that breaks after a long time is found as fast: earlier views are no credit.
#[test]
fn a_promise_that_breaks_late_is_found_as_fast() {
    let kept = Stream { times: 0.6, variation: 0.4, foreground_ratio: 1.0 };
    let broken = Stream { times: 2.0, ..kept };
    for seed in 0..20 {
        let mut random = Random(seed);
        let mut audit = Audit::new(term("flip 0.05"), 1.0);
        (0..2_000).for_each(|_| audit.observe(&kept.view(&mut random)));
        assert!(!audit.is_alarmed());
        let found = (1..=80).find(|_| {
            audit.observe(&broken.view(&mut random));
            audit.is_alarmed()
        });
        assert!(found.is_some(), "seed {seed}");
    }
}

/// Shares of views over the limit, of which 5 % may be.
#[test]
fn percentiles_are_audited_by_the_share_of_views_over() {
    let alarm = |share: f64, most: usize, seed: u64| {
        let mut random = Random(seed);
        let mut audit = Audit::new(term("flip p95 0.05"), 1.0);
        (1..=most).find(|_| {
            audit.observe(&view(0.5, if random.unit() < share { 0.06 } else { 0.04 }));
            audit.is_alarmed()
        })
    };
    let alarms = (0..RUNS).filter(|&seed| alarm(0.05, 1_000, seed).is_some()).count();
    let found = [0.20, 0.15, 0.10].map(|share| {
        let mut found: Vec<u64> = (0..RUNS).map(|seed| alarm(share, 2_000, seed).unwrap_or(2_001) as u64).collect();
        found.sort_unstable();
        most_of(&found)
    });
    println!("p95: {alarms} of {RUNS} runs at the budget alarm; 20, 15 and 10 % over found within {found:?}");
    assert!(alarms <= 8, "{alarms}");
    assert!(found[0] <= 120 && found[1] <= 200 && found[2] <= 700, "{found:?}");
}

fn audited(stream: Stream, views: u64, seed: u64) -> Audit {
    let mut random = Random(seed);
    let mut audit = Audit::new(term("flip 0.05"), stream.foreground_ratio);
    (0..views).for_each(|_| audit.observe(&stream.view(&mut random)));
    audit
}

#[test]
fn intervals_are_as_narrow_as_promised() {
    for variation in [0.1, 0.2, 0.3] {
        let stream = Stream { times: 1.0, variation, foreground_ratio: 1.0 };
        let half_width = |views: u64| {
            let widths = (0..RUNS).map(|seed| {
                let interval = audited(stream, views, seed).error_interval().expect("16 views");
                (interval.high - interval.low) / 2.0 / 0.05
            });
            widths.sum::<f64>() / RUNS as f64
        };
        let [early, late] = [half_width(100), half_width(300)];
        println!("v {variation}: the interval is within {early:.3} of the budget at 100 audits, {late:.3} at 300");
        assert!(early <= 0.10 && late <= 0.06, "{variation}: {early} {late}");
    }
}

/// The interval is read after every view: it may be wrong at none. It is asymptotic: few views of skewed errors cost a
/// little of its 95 %.
#[test]
fn intervals_hold_at_all_times_together() {
    for (variation, foreground_ratio) in [(0.3, 1.0), (0.6, 1.0), (0.6, 0.3)] {
        let stream = Stream { times: 0.8, variation, foreground_ratio };
        let holds = |seed: u64| {
            let mut random = Random(seed);
            let mut audit = Audit::new(term("flip 0.05"), 1.0);
            (0..500).all(|_| {
                audit.observe(&stream.view(&mut random));
                audit.error_interval().is_none_or(|interval| (interval.low..=interval.high).contains(&0.04))
            })
        };
        let share = (0..RUNS).filter(|&seed| holds(seed)).count() as f64 / RUNS as f64;
        println!(
            "v {variation}, foreground {foreground_ratio}: intervals hold at all 500 views in {:.1} %",
            share * 100.0
        );
        assert!(share >= 0.93, "{variation}: {share}");
    }
}

/// Few views of a kept percentile may show none over: the interval must not be a point then. A known failure: where far more
/// views are over than the limit allows, the interval holds less often.
#[test]
fn intervals_of_percentiles_hold_at_all_times_together() {
    const MANY_RUNS: u64 = 2_000;
    for share in [0.01, 0.03, 0.05, 0.10, 0.20] {
        let holds = |seed: u64| {
            let mut random = Random(seed);
            let mut audit = Audit::new(term("flip p95 0.05"), 1.0);
            (0..500).all(|_| {
                audit.observe(&view(0.5, if random.unit() < share { 0.06 } else { 0.04 }));
                audit.error_interval().is_none_or(|interval| (interval.low..=interval.high).contains(&share))
            })
        };
        let held = (0..MANY_RUNS).filter(|&seed| holds(seed)).count() as f64 / MANY_RUNS as f64;
        println!("p95, {share} over: intervals hold at all 500 views in {:.1} %", held * 100.0);
        let least = if share <= 0.05 { 0.95 } else { 0.88 };
        assert!(held >= least, "{share}: {held}");
    }
}

#[test]
fn a_percentile_without_views_over_has_an_interval() {
    let mut audit = Audit::new(term("flip p95 0.05"), 1.0);
    (0..16).for_each(|_| audit.observe(&view(0.5, 0.04)));
    let interval = audit.error_interval().expect("16 views");
    assert!(interval.low == 0.0 && interval.mean.abs() < 1e-12 && interval.high > 0.1, "{interval:?}");
}

/// Errors of whole views do not depend on the foreground, and a share that is no number must not alarm.
#[test]
fn bets_follow_the_foreground_where_it_counts_and_is_known() {
    let whole = |foreground_ratio| Audit::new(term("flip whole 0.05"), foreground_ratio);
    assert_eq!(whole(0.1), whole(1.0));
    let audit = |foreground_ratio| Audit::new(term("flip 0.05"), foreground_ratio);
    assert_ne!(audit(0.5), audit(1.0));
    for unknown in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut audited = audit(unknown);
        assert_eq!(audited, audit(1.0));
        audited.observe(&view(0.5, 0.06));
        assert!(!audited.is_alarmed(), "{unknown}");
    }
}

#[test]
fn an_interval_is_shown_from_16_views_on() {
    let stream = Stream { times: 1.0, variation: 0.3, foreground_ratio: 0.4 };
    assert_eq!(audited(stream, 15, 1).excess_interval(), None);
    let interval = audited(stream, 16, 1).excess_interval().expect("16 views");
    assert!(interval.low < interval.mean && interval.mean < interval.high);
}

#[test]
fn views_that_do_not_count_are_skipped_and_counted() {
    let mut audit = Audit::new(term("flip p95 0.05"), 1.0);
    audit.observe(&view(0.005, 0.9));
    audit.observe(&ViewErrors { flip: f64::NAN, ..view(0.5, 0.9) });
    audit.observe(&view(0.5, 0.9));
    assert_eq!(audit.views(), [1, 2]);
    let mut audit = Audit::new(term("flip 0.05"), 1.0);
    (0..20).for_each(|_| audit.observe(&view(0.0, 0.0)));
    assert_eq!((audit.error_interval(), audit.is_alarmed()), (None, false), "no view shows a surface");
}

/// The greatest errors, for ever: evidence stays a number.
#[test]
fn evidence_stays_finite() {
    let mut audit = Audit::new(term("flip 0.0001"), 1.0);
    (0..2_000).for_each(|_| audit.observe(&view(1.0, 1.0)));
    assert!(audit.is_alarmed());
    (0..100_000).for_each(|_| audit.observe(&view(1.0, 0.0)));
    assert!(!audit.is_alarmed());
}
