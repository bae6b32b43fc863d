//! Scripts of events with fixed costs and without faults. Policy, K, roles, tiles and epochs of every plan equal those
//! of `golden_plans.txt`, from the scheduler before decisions on faults moved into it.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::num::NonZeroU32;
use std::path::Path;
use std::time::Duration;

use cluster::{
    Assignment, Costs, JoinCluster, NodeStatus, PolicyChoice, Quality, SamplePlanes, SceneHash, SceneRef, TileCosts,
    Timeline, Workload,
};
use coordinator::schedule::{Command, Event, MeasuredCosts, Opening, PolicyOverride, Scheduler};
use depth_image::{Aabb, Environment, ExposureEv, Illumination, PinholeCamera};
use glam::{UVec2, Vec3};

/// Images that are not tileable.
const WHOLE: Costs = Costs {
    sample_image_s: 0.1,
    direct_view_s: 0.1,
    reconstruct_view_s: 0.009,
    load_set_s: 0.005,
    encode_view_s: 0.001,
    in_order: false,
    tiles: None,
};

/// Expensive lighting on images whose upper half shows the sky.
const TILEABLE: Costs = Costs {
    sample_image_s: 5.0,
    tiles: Some(TileCosts { overhead_s: 0.5, row_shares: Some([0.05, 0.15, 0.4, 0.4]) }),
    reconstruct_view_s: 0.114,
    load_set_s: 0.19,
    ..WHOLE
};

const TICK: Duration = Duration::from_millis(500);
const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 0.5, set_count: 60 };

fn workload(images: usize, timeline: Timeline) -> Workload {
    let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8));
    Workload {
        scene: SceneRef { hash: SceneHash::of(b""), package_bytes: 0 },
        sample_cameras: vec![camera.into(); images],
        cell_first_indices: Vec::new(),
        common_cells: Vec::new(),
        sampling: "conventional".to_owned(),
        lighting: "unlit".to_owned(),
        planes: SamplePlanes::default(),
        volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
        background: Environment::default(),
        timeline,
        illumination: Illumination::default(),
        refinement_steps: 1,
        traced_pixel_count: None,
    }
}

/// From a circle around the scene.
fn view(azimuth_rad: f32) -> PinholeCamera {
    let eye = Vec3::new(azimuth_rad.sin(), 0.3, azimuth_rad.cos()) * 4.0;
    PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, UVec2::new(40, 30))
}

fn opening(session: u64, policy: PolicyChoice, views_per_set: usize) -> Opening {
    Opening {
        session,
        workload: workload(4, Timeline::still(0.0)),
        method: "joint_carve".to_owned(),
        views_per_set,
        frames_per_s: None,
        policy_override: PolicyOverride { policy, ..PolicyOverride::default() },
        fallbacks: Vec::new(),
        viewpoints: Vec::new(),
        costs: WHOLE,
        auto_exposure: ExposureEv::ZERO,
        last_view_time_ratio: 1.0,
        shared_light: None,
        note: String::new(),
        budgeted: None,
    }
}

fn opened(opening: Opening) -> Event {
    Event::Opened(Box::new(opening))
}

fn demanded(session: u64, views_per_set: usize, frames_per_s: Option<f64>) -> Event {
    Event::DemandChanged { session, views_per_set, frames_per_s }
}

fn viewpoints_changed(session: u64, viewpoints: Vec<PinholeCamera>) -> Event {
    Event::ViewpointsChanged { session, viewpoints }
}

fn frame_rate(frames_per_s: f64) -> Option<f64> {
    (frames_per_s > 0.0).then_some(frames_per_s)
}

fn forced(forced_samplers: Option<usize>, forced_tiles: Option<usize>) -> PolicyOverride {
    PolicyOverride { policy: PolicyChoice::Pipeline, forced_samplers, forced_tiles }
}

/// A scheduler, its clock, and the text of its plans.
struct Script {
    scheduler: Scheduler,
    now: Duration,
    text: String,
}

impl Script {
    fn new(title: &str, nodes: u64) -> Self {
        let mut script = Self { scheduler: Scheduler::default(), now: Duration::ZERO, text: format!("# {title}\n") };
        (0..nodes).for_each(|number| script.join(number));
        script
    }

    fn join(&mut self, number: u64) {
        let node = NodeStatus {
            node_name: format!("n{number:02}"),
            address: format!("http://n{number}"),
            device_name: "cpu".to_owned(),
            is_software: true,
        };
        self.step(Event::Joined { incarnation: number + 1, join: JoinCluster { node, plan_epoch: 0 } });
    }

    fn leave(&mut self, number: u64) {
        self.step(Event::Left { incarnation: number + 1, node_name: format!("n{number:02}") });
    }

    fn step(&mut self, event: Event) {
        for command in self.scheduler.step(self.now, event) {
            let at_s = self.now.as_secs_f64();
            match command {
                Command::Apply { sessions, plan, .. } => {
                    let plan_text = described(&plan.assignment);
                    let fallback = plan.fallback.map_or(0, NonZeroU32::get);
                    writeln!(self.text, "{at_s:.1} s, sessions {sessions:?}, fallback {fallback}: {plan_text}")
                        .unwrap();
                }
                Command::Refuse { session, .. } => {
                    writeln!(self.text, "{at_s:.1} s, session {session} is refused").unwrap();
                }
                Command::Probe(_) => (),
                Command::Quarantine { .. } | Command::Readmit { .. } => panic!("no node is at fault"),
                Command::ProbeViews(_) | Command::Promise { .. } => {
                    panic!("no session has a budget")
                }
            }
        }
    }

    fn plan(&self) -> Option<Assignment> {
        self.scheduler.status().workloads.first()?.plan.clone().map(|plan| plan.assignment)
    }

    /// All nodes take the plan in force at once.
    fn ready(&mut self) {
        let Some(plan_epoch) = self.plan().map(|plan| plan.plan_epoch) else { return };
        for node in self.scheduler.status().nodes {
            self.step(Event::Ready { plan_epoch, node_name: node.node_name });
        }
    }

    fn wait(&mut self, seconds: u32) {
        for _ in 0..seconds * 2 {
            self.ready();
            self.now += TICK;
            self.step(Event::Tick);
        }
    }

    fn measured(&mut self, number: u64, costs: MeasuredCosts) {
        let Some(plan_epoch) = self.plan().map(|plan| plan.plan_epoch) else { return };
        let node_name = format!("n{number:02}");
        self.step(Event::Measured { node_name, plan_epoch, costs, busy_s: 0.25, views: 5, dropped_views: 0 });
    }

    /// A node reports costs that are `times` the given ones, for as long as `seconds`.
    fn report(&mut self, nodes: std::ops::Range<u64>, costs: MeasuredCosts, seconds: u32) {
        for _ in 0..seconds {
            nodes.clone().for_each(|number| self.measured(number, costs));
            self.wait(1);
        }
    }
}

fn timings(costs: &Costs, times: f64) -> MeasuredCosts {
    MeasuredCosts {
        sample_image_s: Some(costs.sample_image_s * times),
        direct_view_s: Some(costs.direct_view_s * times),
        reconstruct_view_s: Some(costs.reconstruct_view_s * times),
        load_set_s: Some(costs.load_set_s * times),
        encode_view_s: Some(costs.encode_view_s * times),
        ..MeasuredCosts::default()
    }
}

/// One line: policy, K, tiles, the relays' fan-out, the workload's size, and each node's roles.
fn described(plan: &Assignment) -> String {
    let mut text = format!(
        "plan {} {} K={} tiles={} relays={} images={} cells={} {}",
        plan.plan_epoch,
        plan.policy,
        plan.samplers.len(),
        plan.tile_count,
        plan.relay_fanout.map_or(0, |fanout| fanout.get()),
        plan.workload.sample_cameras.len(),
        plan.workload.cell_count(),
        plan.workload.lighting,
    );
    for share in &plan.samplers {
        let images: Vec<String> = share.image_indices.iter().map(u32::to_string).collect();
        write!(text, " {}<{}>", share.node_name, images.join(",")).unwrap();
    }
    for share in &plan.compositors {
        write!(text, " {}*{}", share.node_name, share.view_weight).unwrap();
    }
    text
}

const POLICIES: [PolicyChoice; 4] =
    [PolicyChoice::Auto, PolicyChoice::Pipeline, PolicyChoice::Direct, PolicyChoice::TimeShare];

fn every_policy_on_every_cluster() -> String {
    let mut text = String::new();
    for nodes in [1, 2, 3, 5, 8, 11] {
        for policy in POLICIES {
            for views in [1, 10, 40, 200, 1000] {
                let mut script = Script::new(&format!("{nodes} nodes, {policy}, V = {views}"), nodes);
                script.step(opened(opening(1, policy, views)));
                text += &script.text;
            }
        }
    }
    text
}

fn forced_samplers() -> String {
    let mut text = String::new();
    for k in 0..6 {
        let mut script = Script::new(&format!("K = {k} is forced on 5 nodes"), 5);
        let policy_override = forced(Some(k), None);
        script.step(opened(Opening { policy_override, ..opening(1, PolicyChoice::Pipeline, 40) }));
        script.leave(0);
        script.leave(1);
        script.wait(20);
        text += &script.text;
    }
    text
}

fn tiles() -> String {
    let mut text = String::new();
    for nodes in [1, 2, 4, 8, 11] {
        for views in [10, 100, 1000] {
            let mut script = Script::new(&format!("tileable images on {nodes} nodes, V = {views}"), nodes);
            script.step(opened(Opening { costs: TILEABLE, ..opening(1, PolicyChoice::Pipeline, views) }));
            script.report(0..nodes, timings(&TILEABLE, 1.1), 15);
            text += &script.text;
        }
    }
    for tiles in [1, 2, 4, 16] {
        for policy in [PolicyChoice::Pipeline, PolicyChoice::Auto] {
            for images in [3, 4] {
                let mut script = Script::new(&format!("{tiles} tiles of {images} images are forced, {policy}"), 6);
                let policy_override = PolicyOverride { policy, ..forced(None, Some(tiles)) };
                let workload = workload(images, Timeline::still(0.0));
                let whole = Opening { policy_override, workload, ..opening(1, policy, 10) };
                script.step(opened(whole.clone()));
                script.step(Event::Closed { session: 1 });
                script.step(opened(Opening { session: 2, costs: TILEABLE, ..whole }));
                script.wait(20);
                text += &script.text;
            }
        }
    }
    text
}

fn sequential_images() -> String {
    let costs = Costs { in_order: true, ..WHOLE };
    let mut text = String::new();
    for (title, timeline) in [("one set", Timeline::still(0.0)), ("60 sets", MOVING)] {
        for policy in POLICIES {
            let mut script = Script::new(&format!("sequential images, {title}, {policy}"), 7);
            script.step(opened(Opening { costs, workload: workload(4, timeline), ..opening(1, policy, 20) }));
            script.step(demanded(1, 200, frame_rate(0.0)));
            script.wait(30);
            text += &script.text;
        }
    }
    text
}

fn animated() -> String {
    let mut text = String::new();
    for rate in [0.0, 2.0, 30.0] {
        for policy in POLICIES {
            let mut script = Script::new(&format!("an animated scene at {rate} frames/s, {policy}"), 6);
            let frames_per_s = frame_rate(rate);
            let asked = Opening { frames_per_s, workload: workload(5, MOVING), ..opening(1, policy, 3) };
            script.step(opened(asked));
            script.wait(10);
            script.step(demanded(1, 30, frame_rate(rate)));
            script.wait(30);
            text += &script.text;
        }
    }
    text
}

fn quality(method: &str, frame_rate_ratio: f64) -> Quality {
    Quality { lighting: "soft".to_owned(), method: method.to_owned(), sample_side_ratio: 0.5, frame_rate_ratio }
}

fn overload_of_a_static_scene() -> String {
    let mut script = Script::new("a static scene with a rate: admission, overload, fallbacks and the way back", 2);
    let rated = |session, rate, fallbacks| {
        opened(Opening { frames_per_s: frame_rate(rate), fallbacks, ..opening(session, PolicyChoice::Auto, 1) })
    };
    let fallbacks = vec![quality("joint_carve:1", 1.0), quality("joint_carve:2", 0.8)];
    script.step(rated(1, 150.0, fallbacks.clone()));
    script.step(rated(2, 100.0, Vec::new()));
    script.step(rated(3, 30.0, fallbacks));
    script.report(0..2, timings(&WHOLE, 1.25), 60);
    script.step(demanded(1, 1, frame_rate(10.0)));
    script.wait(120);
    script.step(Event::Closed { session: 3 });
    script.wait(30);
    script.text
}

fn one_session_after_the_other() -> String {
    let mut script = Script::new("one session after the other, each with another policy", 5);
    for (session, policy) in (1..).zip(POLICIES) {
        script.step(opened(opening(session, policy, 40)));
        script.wait(7);
        script.step(Event::Closed { session });
    }
    script.step(opened(Opening { workload: workload(3, MOVING), ..opening(5, PolicyChoice::Pipeline, 5) }));
    script.wait(30);
    script.step(Event::Closed { session: 5 });
    script.step(opened(opening(6, PolicyChoice::Auto, 400)));
    script.step(opened(opening(7, PolicyChoice::Auto, 2)));
    script.wait(30);
    script.step(Event::Closed { session: 6 });
    script.wait(30);
    script.text
}

fn nodes_of_different_speed() -> String {
    let mut text = String::new();
    for policy in [PolicyChoice::Pipeline, PolicyChoice::Auto] {
        let mut script = Script::new(&format!("nodes of different speed, {policy}"), 8);
        script.step(opened(opening(1, policy, 60)));
        for round in 0..40 {
            for number in 0..8 {
                let times = [1.0, 1.0, 4.0, 1.5, 1.0, 0.5, 2.0, 1.0][number as usize];
                let noise = 1.0 + 0.05 * f64::from((round * 7 + number as u32) % 5);
                script.measured(number, timings(&WHOLE, times * noise));
            }
            script.wait(1);
        }
        script.step(demanded(1, 600, frame_rate(0.0)));
        script.wait(60);
        text += &script.text;
    }
    text
}

fn one_slow_sampler() -> String {
    let mut script = Script::new("one sampler becomes slow, and fast again", 4);
    script.step(opened(opening(1, PolicyChoice::Pipeline, 30)));
    for times in [10.0, 1.0] {
        let samples = MeasuredCosts { sample_image_s: Some(0.1 * times), ..MeasuredCosts::default() };
        script.report(0..1, samples, 40);
    }
    script.text
}

fn nodes_come_and_go() -> String {
    let mut script = Script::new("nodes join one after the other, then leave in order", 1);
    script.step(opened(opening(1, PolicyChoice::Pipeline, 100)));
    for number in 1..8 {
        script.join(number);
        script.wait(8);
    }
    for number in 0..8 {
        script.leave(number);
        script.wait(3);
    }
    script.join(9);
    script.wait(10);
    script.text
}

fn view_cells() -> String {
    let mut script = Script::new("view cells of sessions that look from different places", 5);
    let from = |session, viewpoints| opened(Opening { viewpoints, ..opening(session, PolicyChoice::Pipeline, 40) });
    script.step(from(1, vec![view(0.0), view(0.1)]));
    script.step(from(2, vec![view(0.05)]));
    script.step(from(3, vec![view(3.0)]));
    script.step(viewpoints_changed(1, vec![view(0.0), view(1.5)]));
    script.wait(10);
    script.step(from(4, (0..30).map(|i| view(0.2 * i as f32)).collect()));
    script.step(demanded(4, 2000, frame_rate(0.0)));
    script.wait(30);
    for session in [4, 1, 2, 3] {
        script.step(Event::Closed { session });
    }
    script.step(opened(opening(5, PolicyChoice::Pipeline, 40)));
    script.text
}

fn slow_links() -> String {
    let mut text = String::new();
    for bytes_per_s in [1e5, 1e6, 1e7] {
        let mut script = Script::new(&format!("links of {bytes_per_s} bytes/s"), 8);
        script.step(opened(opening(1, PolicyChoice::Auto, 1000)));
        let transfer = MeasuredCosts {
            transfer_bytes_per_s: Some(bytes_per_s),
            image_bytes: Some(1e5),
            ..MeasuredCosts::default()
        };
        script.report(0..8, transfer, 30);
        text += &script.text;
    }
    text
}

fn views_swing() -> String {
    let mut script = Script::new("V swings, and K follows two roles at a time", 11);
    script.step(opened(opening(1, PolicyChoice::Pipeline, 1)));
    for views in [500, 1, 30, 500, 30, 1] {
        script.step(demanded(1, views, frame_rate(0.0)));
        script.wait(60);
    }
    script.text
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) % bound
    }
}

fn random_events(seed: u64) -> String {
    let mut script = Script::new(&format!("random events of seed {seed}"), 3);
    let mut random = Random(seed);
    // Sessions of one workload, which all ask for the same.
    let policy = POLICIES[random.below(4) as usize];
    let images = if random.below(3) == 0 { 6 } else { 4 };
    let costs = if random.below(3) == 0 { TILEABLE } else { WHOLE };
    let mut present: Vec<u64> = (0..3).collect();
    let mut sessions: Vec<u64> = Vec::new();
    for number in 3..150 {
        match random.below(10) {
            0 if present.len() < 12 => {
                script.join(number);
                present.push(number);
            }
            1 if present.len() > 1 => {
                let node = present.swap_remove(random.below(present.len() as u64) as usize);
                script.leave(node);
            }
            2..4 if sessions.len() < 4 => {
                let workload = workload(images, Timeline::still(0.0));
                let views = 1 + random.below(500) as usize;
                let asked = Opening { workload, costs, ..opening(number, policy, views) };
                script.step(opened(asked));
                sessions.push(number);
            }
            4 if !sessions.is_empty() => {
                let session = sessions.swap_remove(random.below(sessions.len() as u64) as usize);
                script.step(Event::Closed { session });
            }
            5 if !sessions.is_empty() => {
                let session = sessions[random.below(sessions.len() as u64) as usize];
                script.step(demanded(session, 1 + random.below(800) as usize, frame_rate(0.0)));
            }
            6..8 => {
                let node = present[random.below(present.len() as u64) as usize];
                let times = 0.5 + random.below(20) as f64 / 10.0;
                (0..5).for_each(|_| script.measured(node, timings(&WHOLE, times)));
            }
            _ => script.wait(1 + random.below(8) as u32),
        }
    }
    script.text
}

#[test]
fn plans_without_faults_are_those_of_the_golden_file() {
    let mut text = [
        every_policy_on_every_cluster(),
        forced_samplers(),
        tiles(),
        sequential_images(),
        animated(),
        overload_of_a_static_scene(),
        one_session_after_the_other(),
        nodes_of_different_speed(),
        one_slow_sampler(),
        nodes_come_and_go(),
        view_cells(),
        slow_links(),
        views_swing(),
    ]
    .concat();
    (0..12).for_each(|seed| text += &random_events(seed));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden_plans.txt");
    // Written where it is missing: it is to be deleted only where plans are to change.
    let Ok(golden) = std::fs::read_to_string(&path) else {
        std::fs::write(&path, text).unwrap();
        panic!("{} was missing and has been written", path.display());
    };
    assert!(golden.lines().filter(|line| line.contains("plan ")).count() > 300, "there are plans to compare");
    for (number, (plan, golden)) in text.lines().zip(golden.lines()).enumerate() {
        assert_eq!(plan, golden, "line {}", number + 1);
    }
    assert_eq!(text.len(), golden.len());
}
