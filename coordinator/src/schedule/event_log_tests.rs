use cluster::{MeasuredCosts, PolicyChoice, SamplerReport};

use super::*;
use crate::schedule::event::{Opening, ProbeKind};
use crate::schedule::test_support::{Random, join, opened, opening, view, workload};

fn history() -> Vec<(Duration, Event)> {
    let measured =
        MeasuredCosts { sample_image_s: Some(0.1 + 0.2), image_bytes: Some(1e5), ..MeasuredCosts::default() };
    let named = "n0".to_owned();
    let events = [
        join("n0", 1, 3),
        join("n1", 2, 0),
        opened(7, PolicyChoice::Pipeline, 40),
        Event::Ready { plan_epoch: 4, node_name: named.clone() },
        Event::DemandChanged { session: 7, views_per_set: 500, frames_per_s: Some(0.1) },
        Event::ViewpointsChanged { session: 7, viewpoints: vec![view(0.1), view(1.0 / 3.0)] },
        Event::Measured {
            node_name: named.clone(),
            plan_epoch: 4,
            costs: measured,
            busy_s: 0.3,
            views: 2,
            dropped_views: 1,
        },
        Event::Unready { plan_epoch: 4, node_name: named.clone(), reason: "no \"disk\"\nleft".to_owned() },
        Event::Rejected { plan_epoch: 4, node_name: "n1".to_owned(), reason: "lighting".to_owned() },
        Event::Applied { plan_epoch: 4 },
        Event::Reported(SamplerReport {
            plan_epoch: 5,
            compositor: "n1".to_owned(),
            sampler: named.clone(),
            reason: String::new(),
        }),
        probed(ProbeKind::Image, Some("no images")),
        probed(ProbeKind::Liveness, None),
        Event::Left { incarnation: 1, node_name: named },
        opened(8, PolicyChoice::TimeShare, 1),
        Event::Opened(Box::new(Opening { viewpoints: vec![view(0.7)], ..opening(9, PolicyChoice::Pipeline, 3) })),
        Event::Tick,
        Event::Closed { session: 7 },
    ];
    events.into_iter().enumerate().map(|(i, event)| (Duration::new(i as u64, 123_456_789), event)).collect()
}

fn probed(kind: ProbeKind, failure: Option<&str>) -> Event {
    let node_name = "n0".to_owned();
    let failure = failure.map(str::to_owned);
    Event::Probed { plan_epoch: 5, node_name, incarnation: 1, kind, failure }
}

fn recorded() -> Vec<u8> {
    let mut text = Vec::new();
    let mut recorder = Recorder::new(&mut text).unwrap();
    history().iter().for_each(|(now, event)| recorder.record(*now, event).unwrap());
    text
}

fn refusal(text: &[u8]) -> String {
    replay(text).unwrap_err().to_string()
}

#[test]
fn a_replayed_log_gives_the_same_commands() {
    let mut scheduler = Scheduler::default();
    let mut commanded = 0;
    let steps = replay(&recorded()[..]).unwrap();
    assert_eq!(steps.len(), history().len());
    for ((now, event), step) in history().into_iter().zip(steps) {
        let commands = scheduler.step(now, event.clone());
        commanded += commands.len();
        assert_eq!(step, Step { now, event, commands });
    }
    assert!(commanded > 2, "{commanded}");
}

/// Three workloads on four nodes, one of which is lost while all work.
fn history_of_three_workloads() -> Vec<(Duration, Event)> {
    let open = |session: u64, images: usize| {
        Event::Opened(Box::new(Opening { workload: workload(images), ..opening(session, PolicyChoice::Auto, 40) }))
    };
    let mut events = vec![Event::Limits { max_workloads: 3, audit_time_ratio: 0.01 }];
    events.extend((0..4).map(|number| join(&format!("n{number}"), number, 0)));
    events.extend([open(1, 4), open(2, 3), open(3, 2), open(4, 5), open(5, 3)]);
    events.extend(vec![Event::Tick; 20]);
    events.push(Event::Left { incarnation: 1, node_name: "n1".to_owned() });
    events.push(Event::Closed { session: 1 });
    events.extend(vec![Event::Tick; 40]);
    events.into_iter().enumerate().map(|(i, event)| (Duration::from_millis(500 * i as u64), event)).collect()
}

#[test]
fn a_replayed_log_of_three_workloads_gives_the_same_commands() {
    let mut text = Vec::new();
    let mut recorder = Recorder::new(&mut text).unwrap();
    let mut scheduler = Scheduler::default();
    let mut workloads = BTreeMap::new();
    let mut refused = 0;
    let mut commanded = Vec::new();
    for (now, event) in history_of_three_workloads() {
        recorder.record(now, &event).unwrap();
        let commands = scheduler.step(now, event);
        for command in &commands {
            match command {
                Command::Apply { plan, .. } => *workloads.entry(plan.assignment.workload_number).or_insert(0) += 1,
                Command::Refuse { .. } => refused += 1,
                _ => (),
            }
        }
        commanded.push(commands);
    }
    assert!(workloads.len() == 3 && workloads.values().all(|&plans| plans > 0) && refused == 1, "{workloads:?}");
    assert!(replay(&text[..]).unwrap().into_iter().map(|step| step.commands).eq(commanded));
}

#[test]
fn a_log_has_one_line_an_event_after_its_version() {
    let text = String::from_utf8(recorded()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), history().len() + 1);
    assert_eq!(lines[0], r#"{"version":11}"#);
    assert_eq!(
        lines[5],
        "(now_ns:4123456789,event:demand_changed(session:7,views_per_set:500,frames_per_s:Some(0.1)))"
    );
    assert_eq!(lines[lines.len() - 2], "(now_ns:16123456789,event:tick)");
}

/// Bit by bit, of any exponent.
#[test]
fn floats_of_a_log_keep_every_bit() {
    let mut random = Random(7);
    for _ in 0..2000 {
        let busy_s = f64::from_bits(random.next() >> 1);
        let eye_m = f32::from_bits((random.next() >> 33) as u32);
        if !(busy_s.is_finite() && eye_m.is_finite()) {
            continue;
        }
        let node_name = "n".to_owned();
        let costs = MeasuredCosts { image_bytes: Some(busy_s), ..MeasuredCosts::default() };
        let mut viewpoint = view(0.0);
        viewpoint.eye_in_world.x = eye_m;
        for event in [
            Event::Measured { node_name, plan_epoch: 0, costs, busy_s, views: u64::MAX, dropped_views: 0 },
            Event::ViewpointsChanged { session: 1, viewpoints: vec![viewpoint] },
        ] {
            let text = ron::to_string(&event).unwrap();
            assert_eq!(ron::from_str::<Event>(&text).unwrap(), event, "{text}");
        }
    }
}

#[test]
fn an_invalid_line_is_refused_with_its_number_and_field() {
    let after_header = |line: &str| refusal(format!("{{\"version\":11}}\n{line}\n").as_bytes());
    let cases = [
        (
            "(now_ns:0,event:demand_changed(session:1,views_per_set:9999999,frames_per_s:None))",
            "line 2: views_per_set is 9999999",
        ),
        (r#"(now_ns:0,event:left(incarnation:1,node_name:""))"#, "line 2: node_name is missing"),
        ("(now_ns:0,event:closed())", "missing field named `session`"),
        ("(now_ns:0,event:exploded)", "`exploded`"),
        ("(event:tick)", "missing field named `now_ns`"),
        ("(now_ns:-1,event:tick)", "line 2: "),
        ("nonsense", "line 2: "),
    ];
    for (line, part) in cases {
        assert!(after_header(line).contains(part), "{}", after_header(line));
    }
    let whole = String::from_utf8(recorded()).unwrap();
    for (from, to, part) in [
        ("pipeline", "best", "`best`"),
        ("lighting:\"unlit\"", "lighting:\"\"", "line 4: lighting is missing"),
        ("load_set_s:0.005", "load_set_s:-1.0", "line 4: load_set_s is -1"),
    ] {
        assert!(whole.contains(from), "{whole}");
        let text = refusal(whole.replacen(from, to, 1).as_bytes());
        assert!(text.contains(part), "{text}");
    }
    assert!(refusal(b"").starts_with("line 1: "));
    assert!(refusal(&vec![b' '; 17 << 20]).contains("line 1 has more than 16777216 bytes"));
}

/// Version 2 wrote workloads as hexadecimal messages, and numbers as text.
#[test]
fn a_log_of_another_version_is_refused_by_its_version() {
    let old = b"{\"version\":2}\n{\"now_ns\":0,\"event\":\"tick\"}\n";
    assert_eq!(refusal(old), "line 1: version is 2, must be 11");
    assert_eq!(refusal(b"{\"version\":3}\n"), "line 1: version is 3, must be 11");
}

#[test]
fn damaged_logs_are_refused_or_replayed_without_a_panic() {
    let whole = recorded();
    let mut refused = 0;
    for seed in 0..2000 {
        let mut random = Random(seed);
        let mut text = whole.clone();
        for _ in 0..1 + random.below(4) {
            if text.is_empty() {
                break;
            }
            let at = random.below(text.len() as u64) as usize;
            match random.below(3) {
                0 => text[at] = random.below(256) as u8,
                1 => drop(text.remove(at)),
                _ => text.truncate(at.max(1)),
            }
        }
        refused += usize::from(replay(&text[..]).is_err());
    }
    assert!(refused > 1000, "{refused}");
}
