//! Promises and prices of plans for many made-up subjects.

use planner::{Budget, Choice, Metric, Outcome, PromiseState, ProbeView, Purpose, Statistic, at_most_over};

use crate::made_up::{Run, Subject, plan};
use crate::random::Random;

const SEEDS: u64 = 300;
/// Regret is measured against the cheapest row that keeps this share of the budget.
const MARGIN: f64 = 0.95;

/// What a plan was worth.
#[derive(Debug, Clone, Copy)]
struct Case {
    seed: u64,
    variation: f64,
    kind: usize,
    chose_row: bool,
    is_kept: bool,
    /// The chosen price over the least that keeps the budget with a margin; for time, the error over the least.
    regret: f64,
    probes: usize,
    views: usize,
    spent_s: f64,
}

/// The budget of a seed: a level between the least and the greatest error of rows that are cheaper than direct drawing.
fn budget(subject: &Subject, seed: u64) -> (String, usize) {
    let mut random = Random(seed ^ 0xb0d6e7);
    let kind = (seed % 6) as usize;
    let level = random.between(0.05, 0.6);
    let mut flip = subject.flip.clone();
    flip.sort_by(f64::total_cmp);
    let flip = flip[(level * flip.len() as f64) as usize];
    let mut view_s: Vec<f64> = (0..subject.flip.len()).map(|row| subject.price(row).view_s).collect();
    view_s.sort_by(f64::total_cmp);
    let time_ms = 1e3 * view_s[(random.between(0.2, 0.9) * view_s.len() as f64) as usize];
    let text = match kind {
        0 => format!("flip {flip:.5}"),
        1 => format!("flip p95 {:.5}", flip * (1.0 + 1.3 * subject.variation)),
        2 => format!("disocclusion {:.5}%", flip * 10.0),
        3 => format!("psnr {:.3}", -10.0 * (flip * 0.03).log10()),
        4 => format!("time {time_ms:.4}ms"),
        _ => format!("flip {flip:.5}, time {time_ms:.4}ms"),
    };
    (text, kind)
}

/// The error of a row that the budget limits, exactly, or on 4,000 views for percentiles.
fn true_error(subject: &Subject, row: usize, budget: &Budget) -> f64 {
    let Some(term) = budget.error() else { return subject.flip[row] };
    match (term.statistic(), term.metric()) {
        (Statistic::P95, _) => {
            let mut flips: Vec<f64> =
                (0..4_000).map(|view| subject.errors(row, ProbeView::Fresh((1 << 50) + view)).flip).collect();
            flips.sort_by(f64::total_cmp);
            flips[3_800]
        }
        (_, Metric::Psnr) => subject.flip[row] * 0.03,
        (_, Metric::Disocclusion) => subject.flip[row] * 0.1,
        _ => subject.flip[row],
    }
}

/// The least price with which a share of the budget is kept; for time, the least error within it.
fn best(subject: &Subject, budget: &Budget, share: f64) -> f64 {
    let limit_s = budget.most_view_s().unwrap_or(f64::INFINITY);
    let direct = if subject.direct_s <= limit_s { subject.direct_s } else { f64::INFINITY };
    let rows = 0..subject.flip.len();
    match budget.error() {
        None => {
            let in_time = rows.filter(|&row| subject.price(row).view_s <= limit_s * share);
            let least = in_time.map(|row| subject.flip[row]).fold(f64::INFINITY, f64::min);
            if direct.is_finite() { 0.0 } else { least }
        }
        Some(term) => {
            let most = term.most_ratio() * share;
            let mut cheap: Vec<usize> = rows.filter(|&row| subject.price(row).view_s <= limit_s * share).collect();
            cheap.sort_by(|&a, &b| subject.price(a).node_s.total_cmp(&subject.price(b).node_s));
            let first = cheap.into_iter().find(|&row| true_error(subject, row, budget) <= most);
            first.map_or(direct, |row| subject.price(row).node_s.min(direct))
        }
    }
}

fn case(seed: u64) -> (Case, Run) {
    let subject = Subject::new(seed);
    let (text, kind) = budget(&subject, seed);
    let budget: Budget = text.parse().unwrap();
    let run = plan(&subject, &text, seed);
    let Outcome { choice, state, .. } = run.outcome();
    let limit_s = budget.most_view_s().unwrap_or(f64::INFINITY);
    let (worth, is_kept) = match choice {
        Choice::Direct => (if kind == 4 { 0.0 } else { subject.direct_s }, true),
        Choice::Row(row) => {
            let error = true_error(&subject, row, &budget);
            let is_kept = budget.error().is_none_or(|term| error <= term.most_ratio());
            // The measured time is a mean of noisy ones.
            let in_time = subject.price(row).view_s <= limit_s * 1.02;
            (if kind == 4 { error } else { subject.price(row).node_s }, is_kept && in_time)
        }
    };
    let best = best(&subject, &budget, MARGIN);
    let is_reachable = best.is_finite();
    let regret = if worth == best { 1.0 } else if is_reachable { worth / best } else { f64::NAN };
    let views = |purpose| run.probed(purpose).iter().map(|(_, views)| views.len()).sum::<usize>();
    let case = Case {
        seed,
        variation: subject.variation,
        kind,
        chose_row: matches!(choice, Choice::Row(_)),
        is_kept: is_kept || state == PromiseState::Unreachable,
        regret: if state == PromiseState::Unreachable { f64::NAN } else { regret },
        probes: run.probed(Purpose::Screening).len(),
        views: views(Purpose::Screening) + views(Purpose::Certification),
        spent_s: 0.0,
    };
    (case, run)
}

fn percentile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

#[test]
fn promises_are_kept_and_prices_are_near_the_least() {
    let started = std::time::Instant::now();
    let cases: Vec<Case> = (0..SEEDS).map(|seed| case(seed).0).collect();
    for kind in 0..6 {
        let of: Vec<&Case> = cases.iter().filter(|case| case.kind == kind).collect();
        let mut regrets: Vec<f64> = of.iter().map(|case| case.regret).filter(|regret| regret.is_finite()).collect();
        let n = regrets.len();
        let kept = of.iter().filter(|case| case.is_kept).count();
        let rows = of.iter().filter(|case| case.chose_row).count();
        let low = regrets.iter().filter(|r| **r <= 1.1).count();
        println!(
            "kind {kind}: {} cases, {rows} rows, kept {kept}, regret: {low}/{n} <= 1.1, median {:.3} p90 {:.3} worst {:.3}, views {:.0}",
            of.len(), percentile(&mut regrets, 0.5), percentile(&mut regrets, 0.9), percentile(&mut regrets, 1.0),
            of.iter().map(|case| case.views as f64).sum::<f64>() / of.len() as f64,
        );
    }
    for case in cases.iter().filter(|case| case.regret > 1.5 || !case.is_kept) {
        println!("{case:?}");
    }
    println!("{:?}", started.elapsed());
    let _ = at_most_over(1, 1, 0.5);
}

#[test]
#[ignore = "debug"]
fn debug_seed() {
    let seed: u64 = std::env::var("SEED").unwrap().parse().unwrap();
    let subject = Subject::new(seed);
    let (text, _) = budget(&subject, seed);
    let parsed: Budget = text.parse().unwrap();
    let mut planner = crate::made_up::planner(&subject, crate::made_up::request(&text, seed));
    let run = crate::made_up::run(&mut planner, &subject, planner::Kept::empty(crate::made_up::key()));
    println!("{text} v {} fg {} direct {}: {}", subject.variation, subject.least_foreground(), subject.direct_s, run.outcome().reason);
    let mut rows: Vec<_> = planner.summaries().into_iter().enumerate().collect();
    rows.sort_by(|a, b| a.1.price.node_s.total_cmp(&b.1.price.node_s));
    let limit = parsed.error().map_or(1.0, |t| t.most_ratio());
    for (row, s) in rows {
        println!("{row} {:?} n {} est {:.3} true {:.3} price {:.5} true {:.5}", s.status, s.screening_views, s.error_ratio.unwrap_or(0.0) / limit, true_error(&subject, row, &parsed) / limit, s.price.node_s, subject.price(row).node_s);
    }
    for (row, views) in run.probed(Purpose::Certification) { println!("cert {row} {}", views.len()); }
}
