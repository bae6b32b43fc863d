//! Plans that begin with what earlier plans measured.

use planner::{Choice, Command, Event, Kept, KeptKey, PlanRequest, ProbeView, PromiseState, Purpose, RowStatus};

use crate::made_up::{Run, Subject, answer, busy_s, key, plan, planner, request, run};

fn subject(seed: u64) -> Subject {
    Subject::new(seed).with_direct(1.0)
}

/// The limit that about a third of the rows keep.
fn limit(subject: &Subject) -> f64 {
    let mut flip = subject.flip.clone();
    flip.sort_by(f64::total_cmp);
    flip[flip.len() / 3]
}

fn plan_again(subject: &Subject, request: PlanRequest, kept: &Kept) -> Run {
    run(&mut planner(subject, request), subject, kept.clone())
}

/// The number of the greatest fresh view that a run used.
fn greatest(run: &Run) -> Option<u64> {
    let views = run.probed(Purpose::Certification).into_iter().flat_map(|(_, views)| views);
    views.filter_map(|view| if let ProbeView::Fresh(number) = view { Some(number) } else { None }).max()
}

fn least(run: &Run) -> Option<u64> {
    let views = run.probed(Purpose::Certification).into_iter().flat_map(|(_, views)| views);
    views.filter_map(|view| if let ProbeView::Fresh(number) = view { Some(number) } else { None }).min()
}

#[test]
fn a_search_is_not_made_again() {
    for seed in 0..30 {
        let subject = subject(seed);
        let budget = format!("flip {:.5}", limit(&subject));
        let first = plan(&subject, &budget, seed);
        let again = plan_again(&subject, request(&budget, seed), &first.kept());
        let measured = |run: &Run| {
            run.commands.iter().filter(|c| matches!(c, Command::Probe { .. } | Command::Time { .. })).count()
        };
        assert_eq!(measured(&again), 0, "seed {seed}");
        assert_eq!((again.outcome().choice, again.outcome().price), (first.outcome().choice, first.outcome().price));
        assert_eq!(again.kept(), first.kept(), "seed {seed}");
        let elsewhere = PlanRequest { pricing: "others".to_owned(), ..request(&budget, seed) };
        let elsewhere = plan_again(&subject, elsewhere, &first.kept());
        assert_eq!(elsewhere.kept().searches.len(), 2, "other prices are another search");
    }
}

/// A device that was lost, or a row whose certificate is gone, may be there at the next plan.
#[test]
fn a_search_with_a_row_that_failed_or_is_gone_is_made_again() {
    let subject = subject(4);
    let budget = format!("flip {:.5}", limit(&subject));
    let whole = plan(&subject, &budget, 4);
    let Choice::Row(row) = whole.outcome().choice else { panic!("{}", whole.outcome().reason) };
    let mut kept = whole.kept();
    assert_eq!(kept.searches[0].row.as_ref(), Some(&subject.ladder.rows()[row]));
    kept.rows.iter_mut().for_each(|kept| kept.certificates.clear());
    let again = plan_again(&subject, request(&budget, 4), &kept);
    assert!(!again.probed(Purpose::Certification).is_empty(), "the certificate is gone");

    let mut planner = planner(&subject, request(&budget, 4));
    let mut commands = planner.step(Event::Remembered(Kept::empty(key())));
    let mut has_failed = false;
    let kept = loop {
        match commands.first() {
            Some(Command::Probe { id, .. }) if !has_failed => {
                has_failed = true;
                commands = planner.step(Event::Failed { id: *id, reason: "lost".to_owned(), busy_s: 0.0 });
            }
            Some(Command::Keep(kept)) => break kept.clone(),
            Some(command) => commands = planner.step(answer(&subject, command).expect("an answer")),
            None => panic!("the plan has stopped"),
        }
    };
    assert_eq!(kept.searches, [], "a row failed");
}

/// A choice within a time is by measured times, though another device has certified the row.
#[test]
fn rows_within_a_time_are_measured_before_they_are_chosen() {
    let mut chosen = 0;
    for (seed, error) in (0..20).flat_map(|seed| [(seed, true), (seed, false)]) {
        let subject = subject(seed);
        let most = if error { format!("flip {:.5}, ", limit(&subject)) } else { String::new() };
        let budget = format!("{most}time 5ms");
        let first = plan(&subject, &budget, seed);
        let elsewhere = PlanRequest { device: "another".to_owned(), ..request(&budget, seed) };
        let again = plan_again(&subject, elsewhere, &first.kept());
        let Choice::Row(row) = again.outcome().choice else { continue };
        let kept = again.kept();
        let kept = kept.rows.iter().find(|kept| kept.row == subject.ladder.rows()[row]).expect("the row");
        assert!(kept.costs.iter().any(|costs| costs.device == "another"), "seed {seed}: {budget}");
        chosen += 1;
    }
    assert!(chosen >= 10, "{chosen}");
}

/// A search whose allowance was spent is made to its end by the next plan.
#[test]
fn a_search_that_ended_early_goes_on() {
    let subject = subject(3);
    let budget = format!("flip {:.5}", limit(&subject));
    let early = PlanRequest { allowance_s: 0.5, ..request(&budget, 3) };
    let early = plan_again(&subject, early, &Kept::empty(key()));
    assert_eq!(early.kept().searches, []);
    let later = plan_again(&subject, request(&budget, 3), &early.kept());
    assert_eq!((later.kept().searches.len(), later.outcome().state), (1, PromiseState::Kept));
}

#[test]
fn a_certificate_serves_a_looser_budget_and_no_stricter_one() {
    let mut reused = 0;
    for seed in 0..20 {
        let subject = subject(seed);
        let most = limit(&subject);
        let first = plan(&subject, &format!("flip {most:.5}"), seed);
        let Choice::Row(row) = first.outcome().choice else { continue };
        let looser = plan_again(&subject, request(&format!("flip {:.5}", most * 1.01), seed), &first.kept());
        let certified = |run: &Run| run.probed(Purpose::Certification).iter().any(|(of, _)| *of == row);
        assert!(!certified(&looser), "seed {seed}");
        reused += usize::from(looser.outcome().choice == Choice::Row(row));

        let stricter = plan_again(&subject, request(&format!("flip {:.5}", most * 0.99), seed), &first.kept());
        assert!(stricter.outcome().choice != Choice::Row(row) || certified(&stricter), "seed {seed}");
    }
    assert!(reused >= 5, "{reused}");
}

#[test]
fn another_budget_draws_views_that_no_plan_has_seen() {
    let mut compared = 0;
    for seed in 0..20 {
        let subject = subject(seed);
        let first = plan(&subject, &format!("flip {:.5}", limit(&subject)), seed);
        let other = plan_again(&subject, request(&format!("flip {:.5}", limit(&subject) * 0.8), seed), &first.kept());
        if let (Some(before), Some(after)) = (greatest(&first), least(&other)) {
            assert!(after > before, "seed {seed}");
            compared += 1;
        }
        let views = |run: &Run| run.probed(Purpose::Screening).iter().map(|(_, views)| views.len()).sum::<usize>();
        let anew = plan(&subject, &format!("flip {:.5}", limit(&subject) * 0.8), seed);
        assert!(views(&other) < views(&anew), "screening goes on from what is known");
    }
    assert!(compared >= 10, "{compared}");
}

/// The nodes' time of a run before its first certificate, in s.
fn screening_s(run: &Run) -> f64 {
    let is_fresh =
        |event: &Event| matches!(event, Event::Probed(probed) if matches!(probed.views[0].0, ProbeView::Fresh(_)));
    run.events.iter().take_while(|event| !is_fresh(event)).map(busy_s).sum()
}

fn has_rejected(kept: &Kept) -> bool {
    kept.rows.iter().any(|row| !row.rejected.is_empty())
}

#[test]
fn a_row_that_no_certificate_has_tested_is_certified_by_the_next_plan() {
    let mut certified = 0;
    for seed in 0..20 {
        let subject = subject(seed);
        let budget = format!("flip {:.5}", limit(&subject));
        let whole = plan(&subject, &budget, seed);
        let allowance_s = screening_s(&whole) - 1e-6;
        let early = PlanRequest { allowance_s, ..request(&budget, seed) };
        let early = plan_again(&subject, early, &Kept::empty(key()));
        assert_eq!(early.probed(Purpose::Certification), [], "the allowance is spent in screening");
        assert_eq!((early.outcome().choice, has_rejected(&early.kept())), (Choice::Direct, false), "seed {seed}");

        let later = plan_again(&subject, request(&budget, seed), &early.kept());
        assert_eq!(later.outcome().certificate.is_some(), whole.outcome().certificate.is_some(), "seed {seed}");
        certified += usize::from(later.outcome().certificate.is_some());
    }
    assert!(certified >= 15, "{certified}");
}

/// Rows that passed, and are too slow or too close in price to another, are not rejected.
#[test]
fn rows_are_rejected_only_after_a_failed_certificate() {
    let mut without_failure = 0;
    let mut with_failure = 0;
    for (seed, time) in (0..40).flat_map(|seed| [(seed, ""), (seed, ", time 5ms")]) {
        let subject = subject(seed);
        let budget = format!("flip {:.5}{time}", limit(&subject));
        let mut planner = planner(&subject, request(&budget, seed));
        let run = run(&mut planner, &subject, Kept::empty(key()));
        let summaries = planner.summaries();
        let is_certified = |row: usize| summaries[row].status == RowStatus::Certified;
        let has_failed = run.probed(Purpose::Certification).into_iter().any(|(row, _)| !is_certified(row));
        if has_failed {
            with_failure += usize::from(has_rejected(&run.kept()));
        } else {
            assert!(!has_rejected(&run.kept()), "seed {seed}");
            without_failure += 1;
        }
    }
    println!("rows were rejected in {with_failure} plans with a failure, none in {without_failure} without");
    assert!(without_failure >= 10 && with_failure >= 1, "{without_failure} {with_failure}");
}

/// The allowance ends right after the first failure, before a second round decides.
#[test]
fn an_interrupted_second_round_remembers_the_failure_of_the_first() {
    let mut interrupted = 0;
    for seed in 0..40 {
        let mut subject = subject(seed);
        subject.variation = 0.5;
        let budget = format!("flip {:.5}", limit(&subject));
        let mut planner = planner(&subject, request(&budget, seed));
        let mut commands = planner.step(Event::Remembered(Kept::empty(key())));
        while let Some(event) = commands.iter().find_map(|command| answer(&subject, command)) {
            let tested = certified_row(&commands);
            commands = planner.step(event);
            let failed = tested.filter(|&row| planner.summaries()[row].status != RowStatus::Certified);
            let Some(failed) = failed.filter(|_| certified_row(&commands) != tested) else { continue };
            if !commands.iter().any(|command| matches!(command, Command::Keep(_))) {
                commands = planner.step(Event::Allowed { allowance_s: 0.0 });
                interrupted += 1;
            }
            let kept = Run { commands: commands.clone(), ..Run::default() }.kept();
            let kept = kept.rows.iter().find(|row| row.row == subject.ladder.rows()[failed]).expect("the row");
            assert_eq!(kept.rejected, [budget.parse().unwrap()], "seed {seed}");
            break;
        }
    }
    println!("{interrupted} of 40 plans were interrupted after a first failure");
    assert!(interrupted >= 3, "{interrupted}");
}

/// The row that a command certifies.
fn certified_row(commands: &[Command]) -> Option<usize> {
    commands.iter().find_map(|command| match command {
        Command::Probe { row, purpose: Purpose::Certification, .. } => Some(*row),
        _ => None,
    })
}

#[test]
fn errors_hold_on_another_device_and_costs_do_not() {
    let subject = subject(1);
    let budget = format!("flip {:.5}", limit(&subject));
    let first = plan(&subject, &budget, 1);
    for request in [
        PlanRequest { device: "another".to_owned(), ..request(&budget, 1) },
        PlanRequest { program_version: "2".to_owned(), ..request(&budget, 1) },
    ] {
        let again = plan_again(&subject, request, &first.kept());
        let times = |run: &Run| run.commands.iter().filter(|c| matches!(c, Command::Time { .. })).count();
        assert!(times(&again) >= 1, "costs are timed again");
        let views = |run: &Run| run.probed(Purpose::Screening).iter().map(|(_, views)| views.len()).sum::<usize>();
        assert!(views(&again) * 4 < views(&first), "{} of {}", views(&again), views(&first));
        let devices = again.kept().rows.iter().map(|row| row.costs.len()).max();
        assert_eq!(devices, Some(2), "costs of both are kept");
    }
}

/// On another device, rows are timed one by one for the prediction of costs, then finalists in turn.
#[test]
fn only_costs_of_finalists_are_settled() {
    let mut single = 0;
    let mut settled = 0;
    for seed in 0..20 {
        let subject = subject(seed);
        let budget = format!("flip {:.5}", limit(&subject));
        let first = plan(&subject, &budget, seed);
        let elsewhere = PlanRequest { device: "another".to_owned(), ..request(&budget, seed) };
        let again = plan_again(&subject, elsewhere, &first.kept());
        let timed = again.commands.iter().filter_map(|command| match command {
            Command::Time { rows, .. } => Some(rows.clone()),
            _ => None,
        });
        let (finalists, others): (Vec<_>, Vec<_>) = timed.partition(|rows| rows.len() > 1);
        let finalists: Vec<usize> = finalists.concat();
        let kept = again.kept();
        let is_settled = |row: usize| {
            let kept = kept.rows.iter().find(|kept| kept.row == subject.ladder.rows()[row]).expect("a timed row");
            kept.costs.last().expect("costs").is_settled
        };
        assert!(finalists.iter().all(|&row| is_settled(row)), "seed {seed}");
        let others: Vec<usize> = others.concat().into_iter().filter(|row| !finalists.contains(row)).collect();
        assert!(!others.into_iter().inspect(|_| single += 1).any(is_settled), "seed {seed}");
        settled += finalists.len();
    }
    assert!(single >= 20 && settled >= 2, "{single} {settled}");
}

/// A text of a key.
type Text = fn(&mut KeptKey) -> &mut String;

#[test]
fn measurements_of_another_key_are_refused_by_field() {
    let subject = subject(1);
    let fields: [(&str, Text); 5] = [
        ("scene", |key| &mut key.scene),
        ("cell", |key| &mut key.cell),
        ("lighting", |key| &mut key.lighting),
        ("view_size", |key| &mut key.view_size),
        ("ladder_version", |key| &mut key.ladder_version),
    ];
    for (field, of) in fields {
        let mut other = key();
        of(&mut other).push('x');
        let commands = planner(&subject, request("flip 0.1", 1)).step(Event::Remembered(Kept::empty(other)));
        assert!(matches!(&commands[..], [Command::Refuse(error)] if error.field == field), "{commands:?}");
    }
}
