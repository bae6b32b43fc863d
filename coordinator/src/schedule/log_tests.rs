use cluster::PolicyChoice;

use super::*;
use crate::schedule::MeasuredCosts;
use crate::schedule::Opening;
use crate::schedule::test_support::{Random, join, opened, opening, view};

fn incident() -> Vec<(Duration, Event)> {
    let measured =
        MeasuredCosts { sample_image_s: Some(0.1 + 0.2), image_bytes: Some(1e5), ..MeasuredCosts::default() };
    let named = "n0".to_owned();
    let events = [
        join("n0", 1, 3),
        join("n1", 2, 0),
        opened(7, PolicyChoice::Pipeline, 40),
        Event::Ready { plan_epoch: 4, node_name: named.clone() },
        Event::Demanded { session: 7, views_per_set: 500, frames_per_s: 0.1 },
        Event::Looked { session: 7, viewpoints: vec![view(0.1), view(1.0 / 3.0)] },
        Event::Measured {
            node_name: named.clone(),
            plan_epoch: 4,
            costs: measured,
            busy_s: 0.3,
            views: 2,
            dropped_views: 1,
        },
        Event::Unready { plan_epoch: 4, node_name: named.clone(), reason: "no \"disk\"\nleft".to_owned() },
        Event::Left { incarnation: 1, node_name: named },
        opened(8, PolicyChoice::TimeShare, 1),
        Event::Opened(Box::new(Opening { viewpoints: vec![view(0.7)], ..opening(9, PolicyChoice::Pipeline, 3) })),
        Event::Tick,
        Event::Closed { session: 7 },
    ];
    events.into_iter().enumerate().map(|(i, event)| (Duration::new(i as u64, 123_456_789), event)).collect()
}

fn recorded() -> Vec<u8> {
    let mut text = Vec::new();
    let mut recorder = Recorder::new(&mut text).unwrap();
    incident().iter().for_each(|(now, event)| recorder.record(*now, event).unwrap());
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
    assert_eq!(steps.len(), incident().len());
    for ((now, event), step) in incident().into_iter().zip(steps) {
        let commands = scheduler.step(now, event.clone());
        commanded += commands.len();
        assert_eq!(step, (now, event, commands));
    }
    assert!(commanded > 2, "{commanded}");
}

#[test]
fn one_line_an_event_after_the_version() {
    let text = String::from_utf8(recorded()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), incident().len() + 1);
    assert_eq!(lines[0], r#"{"version":2}"#);
    assert_eq!(
        lines[5],
        r#"{"now_ns":4123456789,"event":"demanded","session":7,"views_per_set":500,"frames_per_s":"0.1"}"#
    );
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let after_header = |line: &str| refusal(format!("{{\"version\":2}}\n{line}\n").as_bytes());
    let cases = [
        (
            r#"{"now_ns":0,"event":"demanded","session":1,"views_per_set":9999999,"frames_per_s":"0"}"#,
            "line 2: views_per_set is 9999999",
        ),
        (r#"{"now_ns":0,"event":"left","incarnation":1,"node_name":""}"#, "line 2: node_name has 0 bytes"),
        (r#"{"now_ns":0,"event":"closed"}"#, "missing field `session`"),
        (r#"{"now_ns":0,"event":"exploded"}"#, "unknown variant `exploded`"),
        (r#"{"event":"tick"}"#, "missing field `now_ns`"),
        (r#"{"now_ns":-1,"event":"tick"}"#, "line 2: "),
        ("nonsense", "line 2: "),
    ];
    for (line, part) in cases {
        assert!(after_header(line).contains(part), "{}", after_header(line));
    }
    let whole = String::from_utf8(recorded()).unwrap();
    for (from, to, part) in [
        ("\"pipeline\"", "\"best\"", "line 4: policy unknown policy"),
        ("\"workload\":\"", "\"workload\":\"xy", "line 4: workload is not hexadecimal"),
        ("\"workload\":\"", "\"workload\":\"00", "line 4: workload workload is corrupt"),
        ("\"load_set_s\":\"0.005\"", "\"load_set_s\":\"-1\"", "line 4: load_set_s is -1"),
        ("\"version\":2", "\"version\":1", "version is 1, must be 2"),
    ] {
        let text = refusal(whole.replacen(from, to, 1).as_bytes());
        assert!(text.contains(part), "{text}");
    }
    assert!(refusal(b"").starts_with("line 1: "));
    assert!(refusal(&vec![b' '; 2 << 20]).contains("line 1 has more than 1048576 bytes"));
}

#[test]
fn damaged_logs_are_refused_or_replayed_and_never_panic() {
    let whole = recorded();
    let mut refused = 0;
    for seed in 0..2000 {
        let mut random = Random(seed);
        let mut text = whole.clone();
        for _ in 0..1 + random.below(4) {
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
