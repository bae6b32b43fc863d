//! Faults of nodes: liveness, quarantine, fault attribution and readmission.

use std::time::Duration;

use cluster::{Assignment, FetchImages, SamplerReport};

use super::Scheduler;
use crate::schedule::member::Member;
use crate::schedule::{ChoiceError, Command, Probe, ProbeKind, ProbedImage};

/// Duration of a quarantine, after which a link may be restored.
const QUARANTINE: Duration = Duration::from_secs(30);
/// The same while there is no plan: long enough that the same plan is not made over and over.
const QUARANTINE_WITHOUT_PLAN: Duration = Duration::from_secs(2);
/// Between two liveness probes of a node. Membership shows only that the node reaches the coordinator. With
/// [`PROBE_DEADLINE`] a silent node is replaced within 10 s.
const LIVENESS_INTERVAL: Duration = Duration::from_secs(3);
/// An answer to a probe may take this long, as keepalive allows.
const PROBE_DEADLINE: Duration = Duration::from_secs(5);
/// Sets that a sampler may have to sample before it answers a probe: the probed one, and two that compositors asked for
/// ahead.
const SETS_AHEAD: f64 = 3.0;

impl Scheduler {
    pub(super) fn ready(&mut self, plan_epoch: u64, name: String) -> Vec<Command> {
        if let Some(active) = self.active_plan_for(plan_epoch, &name) {
            active.ready.insert(name);
        }
        Vec::new()
    }

    pub(super) fn rejected(&mut self, plan_epoch: u64, name: String, reason: String) -> Vec<Command> {
        if let Some(active) = self.active_plan_for(plan_epoch, &name) {
            active.rejected.insert(name, reason);
        }
        Vec::new()
    }

    pub(super) fn unready(&mut self, plan_epoch: u64, name: &str, reason: &str) -> Vec<Command> {
        if self.active_plan_for(plan_epoch, name).is_none() {
            return Vec::new();
        }
        self.quarantine(name, &format!("could not take plan {plan_epoch}: {reason}"))
    }

    /// A plan that every node rejects is the sessions' fault; one that some nodes have taken is the fault of the others.
    pub(super) fn applied(&mut self, plan_epoch: u64) -> Vec<Command> {
        let Some(active) = self.active_plan_of(plan_epoch) else { return Vec::new() };
        let rejected = std::mem::take(&mut active.rejected);
        let Some(reason) = rejected.values().next().cloned() else { return Vec::new() };
        if active.ready.is_empty() {
            let sessions = self.workload.take().map(|workload| workload.sessions()).unwrap_or_default();
            let error = ChoiceError::Rejected { reason };
            return sessions.into_iter().map(|session| Command::Refuse { session, error: error.clone() }).collect();
        }
        let quarantined = rejected
            .into_iter()
            .map(|(name, reason)| self.quarantine(&name, &format!("cannot take plan {plan_epoch}: {reason}")));
        quarantined.flatten().collect()
    }

    /// The node gets no role until it is readmitted, joins again, or another workload takes over.
    fn quarantine(&mut self, name: &str, reason: &str) -> Vec<Command> {
        let now = self.now;
        let Some(member) = self.members.get_mut(name).filter(|member| member.quarantined_at.is_none()) else {
            return Vec::new();
        };
        member.quarantined_at = Some(now);
        self.reports.forget(name);
        let mut commands = vec![Command::Quarantine { node_name: name.to_owned(), reason: reason.to_owned() }];
        commands.extend(self.replan_without(name, &format!("node {name} {reason}")));
        commands
    }

    /// Ends quarantines that have lasted. Nodes then wait for a role as if they had just joined.
    pub(super) fn readmit(&mut self) -> Vec<Command> {
        let quarantine = if self.active_plan().is_some() { QUARANTINE } else { QUARANTINE_WITHOUT_PLAN };
        let mut commands = Vec::new();
        for (name, member) in &mut self.members {
            if member.quarantined_at.is_some_and(|since| self.now.saturating_sub(since) >= quarantine) {
                member.quarantined_at = None;
                commands.push(Command::Readmit { node_name: name.clone() });
            }
        }
        commands
    }

    /// Whether a compositor may report a sampler: both have these roles in the plan in force.
    #[must_use]
    pub fn admits_report(&self, report: &SamplerReport) -> bool {
        self.active_plan().is_some_and(|active| active.concerns(report))
    }

    pub(super) fn reported(&mut self, report: SamplerReport) -> Vec<Command> {
        if !self.admits_report(&report) {
            return Vec::new();
        }
        let SamplerReport { plan_epoch, compositor, sampler, reason } = report.clone();
        if self.reports.file(self.now, report) {
            return self.quarantine(&sampler, &format!("sends no images to {compositor} and others: {reason}"));
        }
        self.probe_image(plan_epoch, &sampler).into_iter().collect()
    }

    /// One probe of a sampler at a time. Each report on file has another image fetched.
    fn probe_image(&mut self, plan_epoch: u64, sampler: &str) -> Option<Command> {
        let number = self.reports.count_of(sampler).saturating_sub(1);
        let member = self.members.get(sampler)?;
        let (incarnation, address) = (member.incarnation, member.status.address.clone());
        let sample_image_s = member.estimate.now().costs.sample_image_s;
        let active = self.active_plan_for(plan_epoch, sampler)?;
        let plan = &active.plan.assignment;
        let images = plan.samplers.iter().find(|share| share.node_name == sampler)?.image_indices.len();
        let image = probed_image(plan, sampler, number)?;
        let sampling_s = SETS_AHEAD * sample_image_s * images as f64 / f64::from(plan.tile_count);
        if !active.probed_samplers.insert(sampler.to_owned()) {
            return None;
        }
        Some(Command::Probe(Box::new(Probe {
            plan_epoch,
            node_name: sampler.to_owned(),
            incarnation,
            address,
            image: Some(image),
            deadline: PROBE_DEADLINE + Duration::try_from_secs_f64(sampling_s).unwrap_or_default(),
        })))
    }

    pub(super) fn probed(
        &mut self,
        plan_epoch: u64,
        name: &str,
        incarnation: u64,
        kind: ProbeKind,
        failure: Option<String>,
    ) -> Vec<Command> {
        let is_member = self.members.get(name).is_some_and(|member| member.incarnation == incarnation);
        match (kind, failure) {
            // A node that does not serve is of no use to a later plan either.
            (ProbeKind::Liveness, Some(reason)) if is_member => self.quarantine(name, &reason),
            (ProbeKind::Liveness, _) => Vec::new(),
            (ProbeKind::Image, failure) => self.image_probed(plan_epoch, name, failure),
        }
    }

    fn image_probed(&mut self, plan_epoch: u64, sampler: &str, failure: Option<String>) -> Vec<Command> {
        let probed = self.active_plan_for(plan_epoch, sampler);
        if !probed.is_some_and(|active| active.probed_samplers.remove(sampler)) {
            return Vec::new();
        }
        if let Some(reason) = failure {
            return self.quarantine(sampler, &format!("sends no images: {reason}"));
        }
        let at_fault = self.reports.refute(sampler).into_iter().map(|(compositor, reason)| {
            self.quarantine(&compositor, &format!("reports samplers whose images can be had: {reason}"))
        });
        at_fault.flatten().collect()
    }

    /// Every node that has taken the plan in force is probed at this interval.
    pub(super) fn probe_liveness(&mut self) -> Vec<Command> {
        let Some(active) = self.active_plan() else { return Vec::new() };
        if self.now.saturating_sub(self.liveness_probed_at) < LIVENESS_INTERVAL {
            return Vec::new();
        }
        let plan_epoch = active.epoch();
        let ready = self.members.iter().filter(|(name, _)| active.ready.contains(*name));
        let probe = |(name, member): (&String, &Member)| Probe {
            plan_epoch,
            node_name: name.clone(),
            incarnation: member.incarnation,
            address: member.status.address.clone(),
            image: None,
            deadline: PROBE_DEADLINE,
        };
        let commands = ready.map(probe).map(|probe| Command::Probe(Box::new(probe))).collect();
        self.liveness_probed_at = self.now;
        commands
    }
}

/// The image of a sampler's share at `number`, counted cyclically, of the first set that the sampler samples.
fn probed_image(plan: &Assignment, sampler: &str, number: usize) -> Option<ProbedImage> {
    let sets = (0..plan.sets_at_once()).map(|set_index| (set_index, plan.images_of(sampler, set_index)));
    let (set_index, images) = sets.into_iter().find(|(_, images)| !images.is_empty())?;
    let image = images.get(number % images.len()).copied()?;
    let camera = plan.sampled_cameras().get(image as usize).copied()?;
    let (cell, first) = cell_of_image(plan, image)?;
    let request = FetchImages {
        plan_epoch: plan.plan_epoch,
        workload_number: plan.workload_number,
        set_index,
        cell,
        image_indices: vec![image - first],
    };
    Some(ProbedImage { request, camera })
}

/// The view cell that an image belongs to, and the index of that cell's first image.
fn cell_of_image(plan: &Assignment, image: u32) -> Option<(u32, u32)> {
    let camera = (image / plan.tile_count) as usize;
    (0..plan.workload.cell_count()).find_map(|cell| {
        let cameras = plan.workload.cameras_of_cell(cell)?;
        cameras.contains(&camera).then(|| (cell as u32, cameras.start as u32 * plan.tile_count))
    })
}
