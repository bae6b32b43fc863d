use std::time::Duration;

use app_core::live::{Record, Shown};

use super::*;
use crate::load::clients::{Clients, Outcome};
use crate::load::memory::slope_mib_per_s;
use crate::load::phases::Idle;

fn shown(frame: u64, posed_s: f64, fallback: u32) -> Shown {
    Shown {
        frame,
        posed_s,
        shown_s: posed_s + 0.05,
        plan_epoch: 1,
        set_index: 0,
        set_age_s: 1.0,
        stages_s: [0.05 / 9.0; 9],
        fallback,
    }
}

/// One frame in four is missing, the last is degraded; another client is refused.
fn load() -> Load {
    let clients = Clients { count: 2, rate_hz: 10.0, lasting: Duration::from_secs(4) };
    let kept = (1..=40u64).filter(|frame| frame % 4 != 0);
    let shown = kept.map(|frame| shown(frame, frame as f64 * 0.1 - 0.05, u32::from(frame == 39))).collect();
    let record = Record { shown, posed: 40, error: None, seconds: 4.0 };
    let looks = (0..40).map(|second| (f64::from(second), 100.0 + f64::from(second))).collect();
    Load {
        name: "2 × 10".to_owned(),
        clients,
        outcomes: vec![Outcome::Served(record), Outcome::Refused],
        dropped: [("newer pose".to_owned(), 10)].into(),
        memory: vec![("node-000".to_owned(), looks)],
    }
}

#[test]
fn shares_are_of_poses() {
    let load = load();
    assert_eq!((load.refused(), load.posed(), load.degraded()), (1, 40, 1));
    assert!((load.undegraded_share() - 29.0 / 40.0).abs() < 1e-9);
    assert!((load.rate_shares()[0] - 0.75).abs() < 0.04, "{:?}", load.rate_shares());
    assert!((load.age_ms(0.5) - 50.0).abs() < 1e-6);
}

#[test]
fn growth_is_seen() {
    let load = load();
    assert!((slope_mib_per_s(&load.memory[0].1) - 1.0).abs() < 1e-9);
    assert!((growth(&load) - 4.0 / 124.5).abs() < 1e-3, "{}", growth(&load));
}

#[test]
fn a_report_has_all_of_it() {
    let idle =
        Idle { clients: 200, memory: vec![("coordinator".to_owned(), 10.0, 20.0), ("clients".to_owned(), 0.0, 999.0)] };
    let phases = Phases { device: "none".to_owned(), loads: vec![load(), load(), load()], idle };
    let mut report = Report::new("load", "none");
    add(&phases, &mut report).unwrap();
    assert!((phases.idle.each_mib() - 0.05).abs() < 1e-9);
    assert_eq!(report.checks.len(), 7);
    assert!(!report.exit_ok(), "a quarter of the frames is missing");
    let text = crate::markdown::markdown(&report.tables[0]);
    assert_eq!(text.lines().count(), 7, "{text}");
}
