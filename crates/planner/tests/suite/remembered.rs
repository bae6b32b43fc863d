//! Plans that begin with what earlier plans measured.

use planner::{Choice, Command, Event, Kept, KeptKey, PlanRequest, ProbeView, Purpose};

use crate::made_up::{Run, Subject, key, plan, planner, request, run};

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

/// Almost always nothing is measured again; a row that was too close to another's price may be tried after all.
#[test]
fn the_same_budget_is_answered_from_what_is_kept() {
    let mut without_probe = 0;
    for seed in 0..30 {
        let subject = subject(seed);
        let budget = format!("flip {:.5}", limit(&subject));
        let first = plan(&subject, &budget, seed);
        let again = plan_again(&subject, request(&budget, seed), &first.kept());
        assert_eq!(again.probed(Purpose::Screening), [], "seed {seed}");
        let chosen = again.outcome();
        assert!(chosen.price.node_s <= first.outcome().price.node_s, "seed {seed}");
        without_probe += usize::from(again.probed(Purpose::Certification).is_empty());
    }
    println!("the same budget: nothing was measured in {without_probe} of 30 plans");
    assert!(without_probe >= 24, "{without_probe}");
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
