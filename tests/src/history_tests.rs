//! The checker detects every violation.

use cluster::{Costs, JoinCluster, NodeStatus, PolicyChoice, SamplePlanes, SceneRef, Timeline, Workload};
use coordinator::schedule::{Event, Opening, PolicyOverride, Recorder};
use depth_image::ExposureEv;

use super::*;
use crate::cluster::{offer, rig};
use crate::scalar_engine::illumination;

fn seen(frame: u64, plan_epoch: u64) -> Seen {
    Seen { frame, plan_epoch, set_index: 0, fault: None }
}

fn call(start: Instant, wanted: std::ops::Range<u64>, plan_epoch: u64) -> Call {
    let at = |ms: u64| start + Duration::from_millis(ms);
    let frames = wanted.clone().map(|frame| seen(frame, plan_epoch)).collect();
    Call { asked: at(10 * wanted.start), ended: at(10 * wanted.end), wanted, set_index: 0, frames, error: None }
}

fn workload() -> Workload {
    let offer = offer();
    Workload {
        scene: SceneRef { hash: offer.hash, package_bytes: 1 },
        sample_cameras: rig().into_iter().map(Into::into).collect(),
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: "conventional".to_owned(),
        lighting: "unlit".to_owned(),
        planes: SamplePlanes::default(),
        volume: offer.volume,
        background: offer.background,
        timeline: Timeline::still(0.0),
        illumination: illumination(),
        refinement_steps: 1,
        traced_pixel_count: None,
    }
}

fn joined(name: &str, plan_epoch: u64) -> Event {
    let node = NodeStatus {
        node_name: name.to_owned(),
        address: format!("http://{name}:1"),
        device_name: "d".to_owned(),
        is_software: true,
    };
    Event::Joined { incarnation: plan_epoch + 1, join: JoinCluster { node, plan_epoch } }
}

/// Two nodes that have seen `plan_epoch` join, a session opens, and one of them leaves.
fn log(plan_epoch: u64) -> Vec<u8> {
    let costs = Costs {
        sample_image_s: 0.1,
        direct_view_s: 0.1,
        reconstruct_view_s: 0.01,
        load_set_s: 0.01,
        encode_view_s: 0.001,
        in_order: false,
        tiles: None,
    };
    let opening = Opening {
        session: 9,
        workload: workload(),
        method: "splat".to_owned(),
        views_per_set: 10,
        frames_per_s: None,
        fallbacks: Vec::new(),
        viewpoints: Vec::new(),
        policy_override: PolicyOverride { policy: PolicyChoice::Pipeline, ..PolicyOverride::default() },
        costs,
        auto_exposure: ExposureEv::ZERO,
        last_view_time_ratio: 1.0,
        shared_light: None,
        note: String::new(),
        budgeted: None,
    };
    let left = Event::Left { incarnation: plan_epoch + 1, node_name: "b".to_owned() };
    let events = [joined("a", plan_epoch), joined("b", plan_epoch), Event::Opened(Box::new(opening)), left];
    let mut text = Vec::new();
    let mut recorder = Recorder::new(&mut text).unwrap();
    for (second, event) in (1..).zip(&events) {
        recorder.record(Duration::from_secs(second), event).unwrap();
    }
    text
}

/// A history without violations.
fn good() -> History {
    let start = Instant::now();
    let calls = vec![call(start, 0..3, 1), call(start, 3..6, 1), call(start, 6..9, 2)];
    let mut history = History { calls, plans: Vec::new(), logs: vec![log(0)] };
    history.plans = history.commanded().unwrap();
    history
}

#[test]
fn a_good_history_violates_no_invariant() {
    let history = good();
    assert_eq!(history.plans.iter().map(|plan| plan.plan_epoch).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(history.violations(), [""; 0]);
    let since = history.calls[0].ended - Duration::from_millis(1);
    assert_eq!(history.longest_wait(since), Duration::from_millis(30));
    let restarted = History { logs: vec![log(0), log(2)], ..good() };
    assert_eq!(restarted.violations(), [""; 0]);
}

type Spoil = fn(&mut History);

#[test]
fn every_violation_of_an_invariant_is_found() {
    let spoilt: [(&str, Spoil); 12] = [
        ("no frame came", |h| h.calls.clear()),
        ("of frames 3..6 2 came", |h| drop(h.calls[1].frames.pop())),
        ("of frames 3..6 3 came: Some(\"lost\")", |h| h.calls[1].error = Some("lost".to_owned())),
        ("frame 3 came twice", |h| h.calls[1].frames[1].frame = 3),
        ("frame 2 came twice", |h| h.calls[1].frames[0].frame = 2),
        ("shows set 1 for 0", |h| h.calls[1].frames[0].set_index = 1),
        ("two colours", |h| h.calls[1].frames[0].fault = Some("two colours".to_owned())),
        ("are of plans {1}, after plan 2", |h| h.calls[0].frames[2].plan_epoch = 2),
        ("there are two plans 1", |h| h.plans[0].compositors.clear()),
        ("no log has plan 7", |h| h.plans[0].plan_epoch = 7),
        ("plan 1 after plan 2", |h| h.logs.push(log(0))),
        ("line 1", |h| h.logs[0].clear()),
    ];
    for (what, spoil) in spoilt {
        let mut history = good();
        spoil(&mut history);
        let wrong = history.violations();
        assert!(wrong.iter().any(|wrong| wrong.contains(what)), "{what}: {wrong:?}");
    }
}

#[test]
fn a_plan_that_gives_a_role_twice_is_found() {
    let plan = good().plans.remove(0);
    assert_eq!(roles(&plan), [""; 0]);
    let mut twice = plan.clone();
    twice.compositors.push(plan.compositors[0].clone());
    assert!(roles(&twice)[0].contains("has a compositor twice"));
    let mut tiled = plan.clone();
    tiled.tile_count = 2;
    assert!(roles(&tiled)[0].contains("samples images"), "half of all tiles");
    tiled.samplers[0].image_indices = (0..tiled.image_count() as u32).collect();
    assert_eq!(roles(&tiled), [""; 0]);
    let mut lacking = plan;
    lacking.samplers.clear();
    assert!(roles(&lacking)[0].contains("samples images []"));
}
