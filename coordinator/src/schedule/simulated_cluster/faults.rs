//! Faults and other events, from a seed.

use std::time::Duration;

use cluster::{MeasuredCosts, PolicyChoice};

use super::{IMAGES, MOST_NODES, World};
use crate::schedule::event::{Event, Opening, ProbeKind};
use crate::schedule::test_support::{COSTS, join, opening, workload};

impl World {
    pub(super) fn random_name(&mut self) -> String {
        format!("n{:02}", self.random.below(MOST_NODES))
    }

    pub(super) fn random_policy(&mut self) -> PolicyChoice {
        match self.random.below(12) {
            0 => PolicyChoice::Auto,
            1 => PolicyChoice::Direct,
            2 => PolicyChoice::TimeShare,
            _ => PolicyChoice::Pipeline,
        }
    }

    pub(super) fn later(&mut self, most_ms: u64, event: Event) {
        let delay = Duration::from_millis(self.random.below(most_ms));
        self.coming.push((self.now + delay, event));
    }

    /// A fault, or another event.
    pub(super) fn fault(&mut self) {
        match self.random.below(22) {
            0..4 => self.start(),
            4..6 => self.kill(),
            6 => self.zombie(),
            7..10 => self.open(),
            10..12 => self.close(),
            12..14 => self.swing(),
            14 => self.cannot(),
            15 => self.stale(),
            16..18 => self.slow_down(),
            18 => self.silent(),
            19 => self.work(),
            _ => self.tell(Event::Tick),
        }
    }

    pub(super) fn start(&mut self) {
        let name = self.random_name();
        if !self.alive.contains_key(&name) {
            self.join(name);
        }
    }

    pub(super) fn join(&mut self, name: String) {
        let incarnation = self.next_incarnation;
        self.next_incarnation += 1;
        let speed = if self.random.below(4) == 0 { self.random.between(1.5, 8.0) } else { 1.0 };
        self.alive.insert(name.clone(), (incarnation, speed));
        // A node may have seen plans of an earlier coordinator.
        let seen = if self.random.below(20) == 0 { self.random.below(1000) } else { 0 };
        self.tell(join(&name, incarnation, seen));
    }

    /// The coordinator learns of it, sometimes late.
    pub(super) fn kill(&mut self) {
        let name = self.random_name();
        if let Some((incarnation, _)) = self.alive.remove(&name) {
            self.later(3000, Event::Left { incarnation, node_name: name });
        }
    }

    /// A second process of one name joins; the end of the first is noticed after that.
    pub(super) fn zombie(&mut self) {
        let name = self.random_name();
        if let Some((incarnation, _)) = self.alive.remove(&name) {
            self.join(name.clone());
            self.later(5000, Event::Left { incarnation, node_name: name });
        }
    }

    pub(super) fn open(&mut self) {
        let session = self.next_session;
        self.next_session += 1;
        let images = IMAGES[self.random.below(self.kinds) as usize];
        let policy = self.random_policy();
        let views_per_set = self.random.between(1.0, 500.0) as usize;
        let is_live = self.random.below(4) == 0;
        let frames_per_s = is_live.then(|| self.random.between(0.01, 0.3));
        let opening = Opening { workload: workload(images), frames_per_s, ..opening(session, policy, views_per_set) };
        self.sessions.insert(session, images);
        self.tell(Event::Opened(Box::new(opening)));
    }

    pub(super) fn random_session(&mut self) -> Option<u64> {
        let count = self.sessions.len() as u64;
        if count == 0 { None } else { self.sessions.keys().nth(self.random.below(count) as usize).copied() }
    }

    pub(super) fn close(&mut self) {
        if let Some(session) = self.random_session() {
            self.tell(Event::Closed { session });
        }
    }

    pub(super) fn swing(&mut self) {
        if let Some(session) = self.random_session() {
            let views_per_set = [1, 500, 30][self.random.below(3) as usize];
            self.tell(Event::DemandChanged { session, views_per_set, frames_per_s: None });
        }
    }

    pub(super) fn cannot(&mut self) {
        let (name, plan_epoch) = (self.random_name(), self.random_epoch());
        self.tell(Event::Unready { plan_epoch, node_name: name, reason: "no disk".to_owned() });
    }

    /// A member does not answer.
    pub(super) fn silent(&mut self) {
        let (node_name, plan_epoch) = (self.random_name(), self.random_epoch());
        if let Some(&incarnation) = self.members.get(&node_name) {
            let (kind, failure) = (ProbeKind::Liveness, Some("silent".to_owned()));
            self.tell(Event::Probed { plan_epoch, node_name, incarnation, kind, failure });
        }
    }

    /// Events of an earlier plan and an earlier process.
    pub(super) fn stale(&mut self) {
        let (node_name, plan_epoch) = (self.random_name(), self.random_epoch());
        if self.scheduler.number_of_plan(plan_epoch.saturating_sub(1)).is_none() {
            let plan_epoch = plan_epoch.saturating_sub(1);
            self.tell(Event::Unready { plan_epoch, node_name: node_name.clone(), reason: "late".to_owned() });
            self.tell(Event::Ready { plan_epoch, node_name: node_name.clone() });
        }
        self.tell(Event::Left { incarnation: 0, node_name });
    }

    pub(super) fn slow_down(&mut self) {
        let name = self.random_name();
        if let Some(&(_, speed)) = self.alive.get(&name) {
            let noise = self.random.between(0.8, 1.25);
            let epoch = self.random_epoch();
            self.tell(measured(name, epoch, timings(speed * noise)));
        }
    }

    /// Nodes do something for every workload, which is therefore not idle.
    pub(super) fn work(&mut self) {
        for workload in self.scheduler.status().workloads {
            let Some(plan) = workload.plan else { continue };
            let name = plan.assignment.compositors[0].node_name.clone();
            self.tell(measured(name, plan.assignment.plan_epoch, MeasuredCosts::default()));
        }
    }

    /// The epoch of some workload's plan.
    pub(super) fn random_epoch(&mut self) -> u64 {
        let epochs: Vec<u64> = self.last.values().map(|last| last.plan.assignment.plan_epoch).collect();
        if epochs.is_empty() { 0 } else { epochs[self.random.below(epochs.len() as u64) as usize] }
    }
}

pub(super) fn measured(node_name: String, plan_epoch: u64, costs: MeasuredCosts) -> Event {
    Event::Measured { node_name, plan_epoch, costs, busy_s: 0.1, views: 3, dropped_views: 0 }
}

pub(super) fn timings(times: f64) -> MeasuredCosts {
    MeasuredCosts {
        sample_image_s: Some(COSTS.sample_image_s * times),
        reconstruct_view_s: Some(COSTS.reconstruct_view_s * times),
        ..MeasuredCosts::default()
    }
}
