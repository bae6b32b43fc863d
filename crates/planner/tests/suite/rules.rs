//! Rules that every plan obeys.

use std::collections::BTreeSet;

use planner::{
    Choice, Command, Event, Kept, KeptKey, Ladder, MAX_PROBE_VIEWS, PlanRequest, Planner, Price, Pricing, ProbeId,
    ProbeView, PromiseState, Purpose, Row, RowCosts, RowStatus, ViewErrors,
};

use crate::made_up::{Run, Subject, answer, busy_s, key, ladder, plan, planner, request, run};

/// A budget that about a third of the rows keep.
fn budget(subject: &Subject) -> String {
    let mut flip = subject.flip.clone();
    flip.sort_by(f64::total_cmp);
    format!("flip {:.5}", flip[flip.len() / 3])
}

/// A subject with a plan that certifies rows.
fn subject() -> Subject {
    Subject::new(42).with_direct(1.0)
}

#[test]
fn equal_events_give_equal_commands() {
    for seed in 0..12 {
        let subject = Subject::new(seed);
        let first = plan(&subject, &budget(&subject), seed);
        let mut again = planner(&subject, request(&budget(&subject), seed));
        let commands: Vec<Command> = first.events.into_iter().flat_map(|event| again.step(event)).collect();
        assert_eq!(commands, first.commands);
    }
}

#[test]
fn certificates_use_no_view_of_the_screening_and_none_twice() {
    for seed in 0..40 {
        let subject = Subject::new(seed);
        let run = plan(&subject, &budget(&subject), seed);
        let is_screening = |view: &ProbeView| matches!(view, ProbeView::Screening(number) if *number < 32);
        for (_, views) in run.probed(Purpose::Screening) {
            assert!(views.iter().all(is_screening));
        }
        let mut seen = BTreeSet::new();
        for (row, views) in run.probed(Purpose::Certification) {
            assert!(views.len() <= MAX_PROBE_VIEWS && views.iter().all(|view| !is_screening(view)), "{views:?}");
            assert!(views.iter().all(|view| seen.insert((row, format!("{view:?}")))), "row {row} is fresh each time");
        }
    }
}

/// The views of a row's screening come in one order, up to a level, without gaps.
#[test]
fn screening_goes_through_common_views_in_order() {
    let subject = subject();
    let run = plan(&subject, &budget(&subject), 1);
    for row in 0..subject.flip.len() {
        let probes = run.probed(Purpose::Screening);
        let views: Vec<ProbeView> =
            probes.into_iter().filter(|(of, _)| *of == row).flat_map(|(_, views)| views).collect();
        assert!([0, 4, 8, 16, 32].contains(&views.len()));
        assert!(views.iter().copied().eq((0..views.len() as u32).map(ProbeView::Screening)));
    }
}

/// The planner's own statuses before each command are the oracle: a row that is pruned stays so.
#[test]
fn a_pruned_row_is_never_measured() {
    let mut pruned_count = 0;
    let mut tested = 0;
    let mut wrong = 0;
    for seed in 0..60 {
        let subject = Subject::new(seed);
        let mut planner = planner(&subject, request(&budget(&subject), seed));
        let mut next = Some(Event::Remembered(Kept::empty(key())));
        let mut pruned = BTreeSet::new();
        while let Some(event) = next.take() {
            let commands = planner.step(event);
            let summaries = planner.summaries();
            let are_pruned = |row: &usize| summaries[*row].status == RowStatus::Pruned;
            pruned.extend((0..summaries.len()).filter(are_pruned));
            for command in &commands {
                let rows = match command {
                    Command::Probe { row, .. } => vec![*row],
                    Command::Time { rows, .. } => rows.clone(),
                    _ => Vec::new(),
                };
                assert!(rows.iter().all(|row| !pruned.contains(row)), "seed {seed}");
            }
            next = commands.iter().find_map(|command| answer(&subject, command));
        }
        let check = planner.outcome().pruning;
        assert_eq!(check.pruned, pruned.len());
        (pruned_count, tested, wrong) = (pruned_count + check.pruned, tested + check.tested, wrong + check.wrong);
    }
    println!("pruned {pruned_count}, tested {tested}, of these wrong {wrong}");
    assert!(tested > 20 && wrong * 2 < tested);
    let share = tested as f64 / (pruned_count + tested) as f64;
    assert!((0.04..0.16).contains(&share), "{share}");
}

/// A subject in which more effort makes errors larger, in a ladder of one kind: the rule of pruning is false.
#[test]
fn wrong_prunings_are_counted() {
    let mut tested = 0;
    let mut wrong = 0;
    for seed in 0..20 {
        let mut subject = Subject::new(seed).with_direct(1.0);
        let of_one_kind = |row: &Row| Row { kind: "all".to_owned(), ..row.clone() };
        subject.ladder = Ladder::new(subject.ladder.rows().iter().map(of_one_kind).collect()).unwrap();
        let rows = subject.ladder.rows();
        subject.flip = rows.iter().map(|row| 0.02 * f64::from(row.camera_count) * row.side_ratio).collect();
        let check = plan(&subject, "flip 0.05", seed).outcome().pruning;
        (tested, wrong) = (tested + check.tested, wrong + check.wrong);
    }
    println!("where the rule is false: tested {tested}, wrong {wrong}");
    assert!(wrong > 0 && wrong <= tested);
}

/// The first failure ends a round: rows behind it are not measured in that round.
#[test]
fn the_first_failure_ends_a_round_of_certificates() {
    let mut failures = 0;
    for seed in 0..40 {
        let mut subject = Subject::new(seed);
        (subject.variation, subject.direct_s) = (0.5, 1.0);
        let mut planner = planner(&subject, request(&budget(&subject), seed));
        let run = run(&mut planner, &subject, Kept::empty(key()));
        let rows: Vec<usize> = run.probed(Purpose::Certification).into_iter().map(|(row, _)| row).collect();
        let summaries = planner.summaries();
        let is_certified = |row: &usize| summaries[*row].status == RowStatus::Certified;
        let changes = rows.windows(2).filter(|pair| pair[0] != pair[1]).map(|pair| pair[0]);
        let failed = changes.filter(|row| !is_certified(row)).count();
        assert!(failed <= 1, "a second round follows one failure, and nothing follows two: {rows:?}");
        failures += failed;
    }
    assert!(failures >= 3, "{failures} sequences went on in a second round");
}

#[test]
fn at_most_the_rows_of_a_round_are_certified_under_expensive_light() {
    let mut more = 0;
    for seed in 0..20 {
        let subject = Subject::new(seed).with_direct(1.0);
        let certified = |most_certified: usize| {
            let request = PlanRequest { most_certified, ..request(&budget(&subject), seed) };
            let run = run(&mut planner(&subject, request), &subject, Kept::empty(key()));
            let rows = run.probed(Purpose::Certification).into_iter().map(|(row, _)| row);
            rows.collect::<BTreeSet<usize>>().len()
        };
        let [few, many] = [3, 8].map(certified);
        assert!(few <= 6, "two rounds of three");
        more += usize::from(many > few);
    }
    println!("eight rows a round: more rows are certified than with three in {more} of 20 plans");
    assert!(more >= 1);
}

#[test]
fn finalists_are_timed_once_and_there_are_at_most_four() {
    let mut counts = BTreeSet::new();
    for seed in 0..40 {
        let subject = Subject::new(seed).with_direct(1.0);
        let times = plan(&subject, &budget(&subject), seed).commands.into_iter().filter_map(|command| match command {
            Command::Time { rows, view_count, repeats, .. } => Some((rows.len(), view_count, repeats)),
            _ => None,
        });
        let times: Vec<_> = times.collect();
        assert!(times.len() <= 1);
        counts.extend(times.into_iter().map(|(rows, views, repeats)| {
            assert_eq!((views, repeats), (32, 2));
            rows
        }));
    }
    assert!(counts.iter().all(|rows| *rows <= 4) && !counts.is_empty(), "{counts:?}");
}

#[test]
fn a_budget_that_no_row_keeps_is_drawn_directly() {
    let outcome = plan(&subject(), "flip 0.00001", 1).outcome();
    assert_eq!((outcome.choice, outcome.state), (Choice::Direct, PromiseState::Kept));
    assert!(outcome.reason.starts_with("Direct drawing keeps flip 0.00001"), "{}", outcome.reason);
}

#[test]
fn rows_that_cost_more_than_direct_drawing_are_not_searched() {
    let subject = subject().with_direct(1e-6);
    let run = plan(&subject, &budget(&subject), 1);
    assert_eq!(run.outcome().choice, Choice::Direct);
    assert!(run.probed(Purpose::Screening).len() <= 16, "rows for the prediction of costs");
}

#[test]
fn an_unreachable_budget_says_by_how_much() {
    let run = plan(&subject(), "flip 0.00001, time 3ms", 1);
    let outcome = run.outcome();
    assert_eq!((outcome.choice, outcome.state), (Choice::Direct, PromiseState::Unreachable));
    assert!(outcome.reason.contains("997.000 ms too long"), "{}", outcome.reason);
    assert!(outcome.reason.contains("has the least error: flip 0.0"), "{}", outcome.reason);

    let outcome = plan(&subject(), "time 0.01ms", 1).outcome();
    assert_eq!(outcome.state, PromiseState::Unreachable);
    assert!(matches!(outcome.choice, Choice::Row(_)) && outcome.reason.contains("too long"), "{}", outcome.reason);
}

#[test]
fn time_alone_needs_no_certificate_and_no_search_where_direct_drawing_is_in_time() {
    let run = plan(&subject(), "time 4ms", 1);
    assert!(matches!(run.outcome().choice, Choice::Row(_)));
    assert_eq!((run.probed(Purpose::Certification).len(), run.outcome().certificate), (0, None));
    let fast = subject().with_direct(0.003);
    let run = plan(&fast, "time 4ms", 1);
    assert_eq!((run.outcome().choice, run.outcome().state), (Choice::Direct, PromiseState::Kept));
    assert_eq!(run.probed(Purpose::Screening).len(), 0);
}

/// The allowance ends before the last measurement, or in the midst of the search.
#[test]
fn a_spent_allowance_ends_the_plan_with_the_best_so_far() {
    let mut certified = 0;
    for seed in 0..12 {
        let subject = Subject::new(seed).with_direct(1.0);
        let whole = plan(&subject, &budget(&subject), seed);
        let before_last_s: f64 = whole.events.iter().rev().skip(1).map(busy_s).sum();
        for allowance_s in [0.0, before_last_s * 0.3, before_last_s - 1e-6] {
            let request = PlanRequest { allowance_s, ..request(&budget(&subject), seed) };
            let mut planner = planner(&subject, request);
            let outcome = run(&mut planner, &subject, Kept::empty(key())).outcome();
            assert!(planner.spent_s() <= allowance_s + 5.0, "one measurement more at most");
            assert!(outcome.reason.contains("is spent"), "{}", outcome.reason);
            assert_eq!(outcome.state, PromiseState::Kept);
            assert_eq!(matches!(outcome.choice, Choice::Row(_)), outcome.certificate.is_some());
            assert!(outcome.certificate.is_none() || allowance_s > before_last_s * 0.5);
            certified += usize::from(outcome.certificate.is_some());
        }
    }
    assert!(certified >= 3, "{certified} plans had certified a row");
}

/// Where too little was measured, nobody knows that no row keeps the budget.
#[test]
fn a_spent_allowance_does_not_say_that_nothing_keeps_a_budget() {
    let subject = subject().with_direct(f64::INFINITY);
    let request = PlanRequest { allowance_s: 0.0, ..request(&budget(&subject), 1) };
    let outcome = run(&mut planner(&subject, request), &subject, Kept::empty(key())).outcome();
    assert_eq!(outcome.state, PromiseState::Unreachable);
    assert!(outcome.reason.starts_with("Nothing is known to keep "), "{}", outcome.reason);
}

#[test]
fn an_allowance_of_zero_ends_a_plan_that_waits() {
    let subject = subject();
    let mut planner = planner(&subject, request(&budget(&subject), 1));
    assert_eq!(planner.outcome().state, PromiseState::Measuring);
    assert_eq!(planner.step(Event::Allowed { allowance_s: 100.0 }), [], "nothing is known of earlier plans");
    assert_eq!(planner.step(Event::Remembered(Kept::empty(key()))).len(), 1);
    let commands = planner.step(Event::Allowed { allowance_s: 0.0 });
    assert!(matches!(&commands[..], [Command::Keep(_), Command::Conclude(_)]), "{commands:?}");
    assert_eq!(planner.step(Event::Allowed { allowance_s: 9.0 }), [], "the plan is made");
}

/// A node that cannot measure anything.
#[test]
fn rows_that_cannot_be_measured_are_not_chosen() {
    let subject = subject();
    let mut planner = planner(&subject, request(&budget(&subject), 1));
    let mut commands = planner.step(Event::Remembered(Kept::empty(key())));
    let mut failures = 0;
    while let [Command::Probe { id, .. }] = commands[..] {
        commands = planner.step(Event::Failed { id, reason: "no device".to_owned(), busy_s: 0.1 });
        failures += 1;
    }
    assert_eq!(failures, subject.flip.len());
    assert_eq!((planner.outcome().choice, planner.outcome().state), (Choice::Direct, PromiseState::Kept));
    assert!(planner.summaries().iter().all(|row| row.status == RowStatus::Failed && row.error_ratio.is_none()));
}

#[test]
fn a_row_that_fails_while_it_is_certified_is_skipped() {
    let subject = subject();
    let mut planner = planner(&subject, request(&budget(&subject), 1));
    let mut next = Some(Event::Remembered(Kept::empty(key())));
    let mut failed = None;
    let mut run = Run::default();
    while let Some(event) = next.take() {
        let commands = planner.step(event);
        next = commands.iter().find_map(|command| match command {
            Command::Probe { id, row, purpose: Purpose::Certification, .. } if failed.is_none() => {
                failed = Some(*row);
                Some(Event::Failed { id: *id, reason: String::new(), busy_s: 0.0 })
            }
            command => answer(&subject, command),
        });
        run.commands.extend(commands);
    }
    let failed = failed.expect("a row to certify");
    assert_eq!(planner.summaries()[failed].status, RowStatus::Failed);
    assert_ne!(run.outcome().choice, Choice::Row(failed));
}

/// A value of a view's errors.
type Value = fn(&mut ViewErrors) -> &mut f64;

/// A node that is lost while finalists are timed: what was certified stays.
#[test]
fn finalists_that_cannot_be_timed_keep_their_costs() {
    let mut failed = 0;
    for seed in 0..40 {
        let subject = Subject::new(seed).with_direct(1.0);
        let mut planner = planner(&subject, request(&budget(&subject), seed));
        let mut next = Some(Event::Remembered(Kept::empty(key())));
        while let Some(event) = next.take() {
            next = planner.step(event).iter().find_map(|command| match command {
                Command::Time { id, .. } => {
                    failed += 1;
                    Some(Event::Failed { id: *id, reason: "lost".to_owned(), busy_s: 0.0 })
                }
                command => answer(&subject, command),
            });
        }
        assert!(matches!(planner.outcome().choice, Choice::Row(_)), "seed {seed}");
    }
    assert!(failed >= 1);
}

/// The fresh views of a run that were measured for its first certificate.
fn fresh_views(run: &Run) -> usize {
    let probes = run.probed(Purpose::Certification);
    probes.iter().take_while(|(row, _)| *row == probes[0].0).map(|(_, views)| views.len()).sum()
}

#[test]
fn percentiles_draw_further_views_in_place_of_those_that_show_nothing() {
    let mut subject = Subject::new(5).with_direct(1.0);
    subject.variation = 0.2;
    let budget = budget(&subject).replace("flip ", "flip p95 ");
    let whole = plan(&subject, &budget, 5);
    subject.empty_share = 0.4;
    let run = plan(&subject, &budget, 5);
    let views = run.outcome().certificate.expect("a certificate").views;
    assert!(views >= 59 && fresh_views(&run) > views && fresh_views(&run) > fresh_views(&whole), "{views}");

    subject.empty_share = 1.0;
    let run = plan(&subject, &budget, 5);
    assert_eq!(run.outcome().choice, Choice::Direct);
    assert!(run.probed(Purpose::Certification).is_empty() || fresh_views(&run) <= 2 * 256);
}

/// Every change to an answer that makes it foreign or impossible, with the field that refuses it.
fn damaged(event: &Event) -> Vec<(Event, &'static str)> {
    let Event::Probed(good) = event else { panic!("a probe") };
    let with = |field, change: &dyn Fn(&mut planner::Probed)| {
        let mut bad = good.clone();
        change(&mut bad);
        (Event::Probed(bad), field)
    };
    let mut all = vec![
        with("id", &|bad| bad.id.number += 1),
        with("id", &|bad| bad.id.plan += 1),
        with("row", &|bad| bad.row += 1),
        with("row", &|bad| bad.row = usize::MAX),
        with("views", &|bad| bad.views.clear()),
        with("views", &|bad| bad.views = vec![bad.views[0]; 1_000_000]),
        with("views", &|bad| bad.views.reverse()),
        with("views", &|bad| bad.views.truncate(3)),
        with("views", &|bad| bad.views[0].0 = ProbeView::Fresh(0)),
        with("sample_image_s", &|bad| bad.costs.sample_image_s = f64::NAN),
        with("load_set_s", &|bad| bad.costs.load_set_s = -1.0),
        with("reconstruct_view_s", &|bad| bad.costs.reconstruct_view_s = f64::INFINITY),
        with("load_set_s", &|bad| bad.costs.load_set_s = 1.000_001e6),
        with("busy_s", &|bad| bad.busy_s = f64::NAN),
        with("busy_s", &|bad| bad.busy_s = f64::MAX),
    ];
    for value in [f64::NAN, -0.1, 1.5, f64::INFINITY] {
        let fields: [(&str, Value); 5] = [
            ("foreground_ratio", |errors| &mut errors.foreground_ratio),
            ("flip", |errors| &mut errors.flip),
            ("flip_whole", |errors| &mut errors.flip_whole),
            ("mean_square", |errors| &mut errors.mean_square),
            ("disoccluded_ratio", |errors| &mut errors.disoccluded_ratio),
        ];
        all.extend(fields.map(|(field, of)| with(field, &|bad| *of(&mut bad.views[1].1) = value)));
    }
    all
}

#[test]
fn impossible_and_foreign_measurements_are_refused_by_field_and_change_nothing() {
    let subject = subject();
    let mut planner = planner(&subject, request(&budget(&subject), 1));
    let commands = planner.step(Event::Remembered(Kept::empty(key())));
    let good = answer(&subject, &commands[0]).expect("an answer");
    let mut bad = damaged(&good);
    let id = ProbeId { plan: 1, number: 77 };
    bad.push((Event::Failed { id, reason: String::new(), busy_s: 0.0 }, "id"));
    bad.push((Event::Failed { id, reason: "x".repeat(2_000), busy_s: 0.0 }, "reason"));
    bad.push((Event::Allowed { allowance_s: f64::NAN }, "allowance_s"));
    bad.push((Event::Remembered(Kept::empty(key())), "remembered"));
    let before = (planner.summaries(), planner.outcome());
    for (event, expected) in bad {
        let shown = format!("{event:?}").chars().take(300).collect::<String>();
        match &planner.step(event)[..] {
            [Command::Refuse(error)] => assert_eq!(error.field, expected, "{error}: {shown}"),
            other => panic!("{other:?}: {shown}"),
        }
    }
    assert_eq!((planner.summaries(), planner.outcome()), before);
    assert!(matches!(planner.step(good)[..], [Command::Probe { .. }]), "the right answer still counts");
}

#[test]
fn timings_of_other_rows_are_refused() {
    let mut refused = 0;
    for seed in 0..40 {
        let subject = Subject::new(seed).with_direct(1.0);
        let mut planner = planner(&subject, request(&budget(&subject), seed));
        let mut next = Some(Event::Remembered(Kept::empty(key())));
        while let Some(event) = next.take() {
            if let Event::Timed(timed) = &event {
                let mut bad = timed.clone();
                bad.rows.reverse();
                let commands = planner.step(Event::Timed(bad));
                assert!(matches!(&commands[..], [Command::Refuse(error)] if error.field == "rows"), "{commands:?}");
                refused += 1;
            }
            next = planner.step(event).iter().find_map(|command| answer(&subject, command));
        }
    }
    assert!(refused >= 1);
}

/// A price of all rows that no caller should give.
#[derive(Debug, Clone)]
struct NoPrice(Price);

impl Pricing for NoPrice {
    fn row(&self, _: &Row, _: &RowCosts) -> Price {
        self.0
    }
    fn direct(&self) -> Price {
        Price { node_s: 1.0, view_s: 1.0 }
    }
}

#[test]
fn rows_without_a_price_are_not_chosen() {
    let subject = subject();
    let prices = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1e-9, -1.0];
    let both = prices.map(|bad| [Price { node_s: bad, view_s: 0.001 }, Price { node_s: 0.001, view_s: bad }]);
    for price in both.into_iter().flatten() {
        let request = PlanRequest { most_certified: 1, ..request(&budget(&subject), 1) };
        let mut planner = Planner::new(request, ladder(), NoPrice(price)).unwrap();
        let mut next = Some(Event::Remembered(Kept::empty(key())));
        while let Some(event) = next.take() {
            next = planner.step(event).iter().find_map(|command| answer(&subject, command));
        }
        assert_eq!(
            (planner.outcome().choice, planner.outcome().state),
            (Choice::Direct, PromiseState::Kept),
            "{price:?}"
        );
    }
}

/// Equal prices are valid, also those of 0: the plan ends and chooses a row.
#[test]
fn rows_that_cost_nothing_are_chosen() {
    let subject = subject();
    let free = NoPrice(Price { node_s: 0.0, view_s: 0.0 });
    let request = PlanRequest { most_certified: 1, ..request(&budget(&subject), 1) };
    let mut planner = Planner::new(request, ladder(), free).unwrap();
    let mut next = Some(Event::Remembered(Kept::empty(key())));
    while let Some(event) = next.take() {
        next = planner.step(event).iter().find_map(|command| answer(&subject, command));
    }
    assert!(matches!(planner.outcome().choice, Choice::Row(_)));
}

#[test]
fn impossible_requests_are_refused_by_field() {
    let field = |request: PlanRequest| Planner::new(request, ladder(), subject()).unwrap_err().field;
    let good = || request("flip 0.1", 1);
    let long = "x".repeat(65);
    assert_eq!(field(PlanRequest { key: KeptKey { scene: String::new(), ..key() }, ..good() }), "scene");
    assert_eq!(field(PlanRequest { key: KeptKey { ladder_version: long, ..key() }, ..good() }), "ladder_version");
    assert_eq!(field(PlanRequest { device: String::new(), ..good() }), "device");
    assert_eq!(field(PlanRequest { pricing: String::new(), ..good() }), "pricing");
    assert_eq!(field(PlanRequest { most_certified: 9, ..good() }), "most_certified");
    assert_eq!(field(PlanRequest { allowance_s: -1.0, ..good() }), "allowance_s");
    assert_eq!(field(PlanRequest { allowance_s: 1.1e6, ..good() }), "allowance_s");
}

/// Screening views fill the unit cube evenly, and fresh views are even in the mean.
#[test]
fn places_of_views_cover_the_viewpoints() {
    for axis in 0..3 {
        let mut places: Vec<f64> = (0..32).map(|number| ProbeView::Screening(number).place(5)[axis]).collect();
        places.sort_by(f64::total_cmp);
        assert!(places.windows(2).all(|pair| pair[1] - pair[0] < 0.09), "{places:?}");
        let mean = (0..4_000).map(|number| ProbeView::Fresh(number).place(5)[axis]).sum::<f64>() / 4_000.0;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }
    let place = |seed| ProbeView::Fresh(3).place(seed);
    assert!(place(1) == place(1) && place(1) != place(2), "fresh views follow the seed");
    assert_eq!(ProbeView::Screening(3).place(1), ProbeView::Screening(3).place(2), "common views do not");
}
