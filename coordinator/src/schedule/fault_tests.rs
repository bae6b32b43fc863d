//! Fault attribution over random histories: samplers that fail are quarantined and come back; honest nodes stay.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use cluster::{Assignment, PolicyChoice, SamplerReport};

use super::command::{Command, Probe};
use super::demand::PolicyOverride;
use super::event::{Event, Opening, ProbeKind};
use super::scheduler::Scheduler;
use super::test_support::{Random, join, opening};

const SEEDS: u64 = 200;
const STEP: Duration = Duration::from_millis(100);
/// A faulty node loses its roles within this.
const HEALED_WITHIN: Duration = Duration::from_secs(10);

/// Nodes, what is wrong with them, and what the scheduler did about it.
struct Faults {
    random: Random,
    scheduler: Scheduler,
    now: Duration,
    pending: Vec<(Duration, Event)>,
    /// Samplers that send no image, to compositors and probes alike.
    failed: BTreeSet<String>,
    /// A compositor that gets images of no sampler.
    cut_off: Option<String>,
    quarantined: BTreeSet<String>,
    /// Every node that was ever quarantined, with the number of times.
    convicted: BTreeMap<String, usize>,
}

impl Faults {
    fn new(seed: u64) -> Self {
        let mut faults = Self {
            random: Random(seed),
            scheduler: Scheduler::default(),
            now: Duration::ZERO,
            pending: Vec::new(),
            failed: BTreeSet::new(),
            cut_off: None,
            quarantined: BTreeSet::new(),
            convicted: BTreeMap::new(),
        };
        let nodes = 6 + faults.random.below(5);
        (0..nodes).for_each(|number| faults.tell(join(&format!("n{number:02}"), number, 0)));
        let k = 2 + faults.random.below(2) as usize;
        let policy_override =
            PolicyOverride { policy: PolicyChoice::Pipeline, forced_samplers: Some(k), forced_tiles: None };
        // Views take most of the time: every node that is added makes a set faster.
        let opening = Opening { policy_override, ..opening(1, PolicyChoice::Pipeline, 1000) };
        faults.tell(Event::Opened(Box::new(opening)));
        faults
    }

    fn plan(&self) -> Assignment {
        self.scheduler.status().workloads[0].plan.clone().expect("a plan").assignment
    }

    fn has_role(&self, name: &str) -> bool {
        let plan = self.plan();
        plan.composites(name) || plan.samplers.iter().any(|share| share.node_name == name)
    }

    fn a_sampler(&mut self) -> String {
        let samplers = self.plan().samplers;
        samplers[self.random.below(samplers.len() as u64) as usize].node_name.clone()
    }

    fn a_compositor(&mut self) -> String {
        let compositors = self.plan().compositors;
        compositors[self.random.below(compositors.len() as u64) as usize].node_name.clone()
    }

    fn later(&mut self, most_ms: u64, event: Event) {
        let delay = Duration::from_millis(50 + self.random.below(most_ms));
        self.pending.push((self.now + delay, event));
    }

    fn tell(&mut self, event: Event) {
        for command in self.scheduler.step(self.now, event) {
            match command {
                Command::Apply { plan, nodes, .. } => {
                    let plan_epoch = plan.assignment.plan_epoch;
                    nodes.into_iter().for_each(|node| {
                        self.later(300, Event::Ready { plan_epoch, node_name: node.node_name });
                    });
                }
                Command::Probe(probe) => self.answer(*probe),
                Command::Quarantine { node_name, .. } => {
                    *self.convicted.entry(node_name.clone()).or_default() += 1;
                    assert!(self.quarantined.insert(node_name));
                }
                Command::Readmit { node_name, .. } => assert!(self.quarantined.remove(&node_name), "{node_name}"),
                Command::ProbeViews(_) | Command::Promise { .. } | Command::Refuse { .. } => panic!("{command}"),
            }
        }
    }

    fn answer(&mut self, probe: Probe) {
        let kind = probe.kind();
        let is_failed = kind == ProbeKind::Image && self.failed.contains(&probe.node_name);
        let failure = is_failed.then(|| "no image".to_owned());
        let Probe { plan_epoch, node_name, incarnation, .. } = probe;
        self.later(1500, Event::Probed { plan_epoch, node_name, incarnation, kind, failure });
    }

    /// A compositor asks a sampler for images, and reports it if none come.
    fn fetch(&mut self, compositor: String, sampler: String) {
        if self.failed.contains(&sampler) || self.cut_off.as_ref() == Some(&compositor) {
            self.report(compositor, sampler);
        }
    }

    fn report(&mut self, compositor: String, sampler: String) {
        let plan_epoch = self.plan().plan_epoch;
        let reason = "no images".to_owned();
        self.later(500, Event::Reported(SamplerReport { plan_epoch, compositor, sampler, reason }));
    }

    /// Time passes; every compositor asks a sampler about once a second.
    fn pass(&mut self, duration: Duration) {
        let end = self.now + duration;
        while self.now < end {
            self.now += STEP;
            let now = self.now;
            let (due, pending) = std::mem::take(&mut self.pending).into_iter().partition(|(at, _)| *at <= now);
            self.pending = pending;
            Vec::into_iter(due).for_each(|(_, event)| self.tell(event));
            self.tell(Event::Tick);
            for share in self.plan().compositors {
                if self.random.below(10) == 0 {
                    let sampler = self.a_sampler();
                    self.fetch(share.node_name, sampler);
                }
            }
        }
    }

    /// Lets a sampler fail, and waits until it has no role any more.
    fn fail_a_sampler(&mut self) -> String {
        let name = self.a_sampler();
        self.failed.insert(name.clone());
        let start = self.now;
        while self.has_role(&name) {
            assert!(self.now - start < HEALED_WITHIN, "{name} is still in the plan");
            self.pass(STEP);
        }
        name
    }

    fn convicted(&self) -> BTreeSet<String> {
        self.convicted.keys().cloned().collect()
    }
}

#[test]
fn two_samplers_that_fail_within_a_minute_cost_no_honest_node_its_place() {
    for seed in 0..SEEDS {
        let mut faults = Faults::new(seed);
        faults.pass(Duration::from_secs(5));
        // The fault of one request, which a probe does not confirm.
        let compositor = faults.a_compositor();
        let sampler = faults.a_sampler();
        faults.report(compositor, sampler);
        let first = faults.fail_a_sampler();
        let pause = Duration::from_secs(faults.random.below(25));
        faults.pass(pause);
        let second = faults.fail_a_sampler();
        assert_eq!(faults.convicted(), BTreeSet::from([first.clone(), second.clone()]), "seed {seed}");

        faults.failed.clear();
        faults.pass(Duration::from_secs(60));
        assert_eq!(faults.quarantined, BTreeSet::new(), "seed {seed}: all are readmitted");
        assert_eq!(faults.convicted(), BTreeSet::from([first.clone(), second.clone()]), "seed {seed}");
        assert!(faults.has_role(&first) && faults.has_role(&second), "seed {seed}");
    }
}

#[test]
fn a_compositor_that_is_cut_off_from_samplers_is_quarantined_and_no_sampler_is() {
    for seed in 0..SEEDS {
        let mut faults = Faults::new(seed);
        faults.pass(Duration::from_secs(5));
        let name = faults.a_compositor();
        faults.cut_off = Some(name.clone());
        faults.pass(HEALED_WITHIN);
        assert!(!faults.has_role(&name), "seed {seed}");
        faults.cut_off = None;
        faults.pass(Duration::from_secs(60));
        assert_eq!(faults.convicted(), BTreeSet::from([name.clone()]), "seed {seed}");
        assert!(faults.quarantined.is_empty() && faults.has_role(&name), "seed {seed}: it is readmitted");
    }
}

#[test]
fn a_sampler_that_fails_for_long_is_tried_again_after_each_quarantine() {
    let mut faults = Faults::new(1);
    faults.pass(Duration::from_secs(5));
    let name = faults.fail_a_sampler();
    faults.pass(Duration::from_secs(29));
    assert_eq!(faults.quarantined, BTreeSet::from([name.clone()]));
    faults.pass(Duration::from_secs(2));
    assert_eq!(faults.quarantined, BTreeSet::new());
    faults.pass(Duration::from_secs(120));
    assert_eq!(faults.convicted(), BTreeSet::from([name]), "whatever role it gets, no other node is convicted");
}

/// Answers of a node to the liveness probes of one plan.
#[test]
fn a_node_that_does_not_serve_is_quarantined_and_an_old_process_is_not() {
    let mut faults = Faults::new(2);
    faults.pass(Duration::from_secs(5));
    let name = faults.a_compositor();
    let plan_epoch = faults.plan().plan_epoch;
    let incarnation = name[1..].parse().unwrap();
    let probed = |incarnation, failure: Option<&str>| Event::Probed {
        plan_epoch,
        node_name: name.clone(),
        incarnation,
        kind: ProbeKind::Liveness,
        failure: failure.map(str::to_owned),
    };
    faults.tell(probed(incarnation, None));
    faults.tell(probed(incarnation + 100, Some("silent")));
    assert!(faults.has_role(&name));
    faults.tell(probed(incarnation, Some("silent")));
    assert!(!faults.has_role(&name) && faults.quarantined.contains(&name));
    faults.tell(probed(incarnation, Some("silent")));
    assert_eq!(faults.convicted[&name], 1, "it is in quarantine already");
}

#[test]
fn a_plan_that_some_nodes_reject_is_made_without_them_and_one_that_all_reject_is_refused() {
    let opened = || Event::Opened(Box::new(opening(1, PolicyChoice::Pipeline, 40)));
    let rejected =
        |name: &str| Event::Rejected { plan_epoch: 1, node_name: name.to_owned(), reason: "unknown method".to_owned() };
    let at_start = |scheduler: &mut Scheduler, event| scheduler.step(Duration::ZERO, event);
    let cluster = || {
        let mut scheduler = Scheduler::default();
        (0..3).for_each(|number| drop(at_start(&mut scheduler, join(&format!("n{number}"), number, 0))));
        at_start(&mut scheduler, opened());
        scheduler
    };
    let mut scheduler = cluster();
    assert_eq!(at_start(&mut scheduler, rejected("n0")), []);
    at_start(&mut scheduler, Event::Ready { plan_epoch: 1, node_name: "n1".to_owned() });
    let commands = at_start(&mut scheduler, Event::Applied { plan_epoch: 1 });
    assert!(
        matches!(&commands[..], [Command::Quarantine { node_name, .. }, Command::Apply { .. }] if node_name == "n0")
    );

    let mut scheduler = cluster();
    ["n0", "n1", "n2"].iter().for_each(|name| drop(at_start(&mut scheduler, rejected(name))));
    let commands = at_start(&mut scheduler, Event::Applied { plan_epoch: 1 });
    let [Command::Refuse { session: 1, error }] = &commands[..] else { panic!("{commands:?}") };
    assert_eq!(error.to_string(), "unknown method");
    assert!(scheduler.status().workloads.is_empty() && !scheduler.has_session(1));
}

#[test]
fn a_node_that_fails_to_take_a_plan_is_quarantined_until_it_joins_again() {
    let mut faults = Faults::new(3);
    let name = faults.a_compositor();
    let plan_epoch = faults.plan().plan_epoch;
    let unready = |plan_epoch| Event::Unready { plan_epoch, node_name: name.clone(), reason: "no disk".to_owned() };
    faults.tell(unready(plan_epoch + 7));
    assert!(faults.has_role(&name), "of another plan");
    faults.tell(unready(plan_epoch));
    let reason = faults.scheduler.status().workloads[0].plan.clone().unwrap().reason;
    assert!(!faults.has_role(&name) && reason.contains("no disk"), "{reason}");
    let before = faults.plan().plan_epoch;
    faults.tell(unready(plan_epoch));
    assert_eq!(faults.plan().plan_epoch, before, "that plan is no more");

    let mut rejoined = Faults { quarantined: BTreeSet::new(), ..faults };
    rejoined.tell(join(&name, 77, 1));
    rejoined.pass(Duration::from_secs(15));
    assert!(rejoined.has_role(&name));
}
