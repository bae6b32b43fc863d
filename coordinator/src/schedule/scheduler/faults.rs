//! Faults of nodes: liveness, quarantine, fault attribution and readmission.

use std::time::Duration;

use cluster::{Assignment, FetchImages, SamplerReport};

use super::Scheduler;
use crate::schedule::active_plan::ActivePlan;
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
        let now = self.now;
        if let Some((number, active)) = self.active_plan_for(plan_epoch, &name) {
            active.ready.insert(name);
            self.workloads.get_mut(&number).into_iter().for_each(|workload| workload.note_ready(now));
        }
        Vec::new()
    }

    pub(super) fn rejected(&mut self, plan_epoch: u64, name: String, reason: String) -> Vec<Command> {
        if let Some((_, active)) = self.active_plan_for(plan_epoch, &name) {
            active.rejected.insert(name, reason);
        }
        Vec::new()
    }

    pub(super) fn unready(&mut self, plan_epoch: u64, name: &str, reason: &str) -> Vec<Command> {
        let Some((number, _)) = self.active_plan_for(plan_epoch, name) else { return Vec::new() };
        self.exclude(number, name, &format!("could not take plan {plan_epoch}: {reason}"))
    }

    /// A plan that every node rejects is the sessions' fault; one that some nodes have taken is the fault of the others.
    pub(super) fn applied(&mut self, plan_epoch: u64) -> Vec<Command> {
        let Some((number, active)) = self.active_plan_of(plan_epoch) else { return Vec::new() };
        let rejected = std::mem::take(&mut active.rejected);
        let Some(reason) = rejected.values().next().cloned() else { return Vec::new() };
        if active.ready.is_empty() {
            let error = ChoiceError::Rejected { reason };
            let sessions = self.workloads.get(&number).map(|workload| workload.sessions.numbers()).unwrap_or_default();
            let refusals = sessions.into_iter().map(|session| Command::Refuse { session, error: error.clone() });
            let mut commands: Vec<Command> = refusals.collect();
            commands.extend(self.end(number));
            return commands;
        }
        let excluded = rejected
            .into_iter()
            .map(|(name, reason)| self.exclude(number, &name, &format!("cannot take plan {plan_epoch}: {reason}")));
        excluded.flatten().collect()
    }

    /// The node gets no role in any plan until it is readmitted or joins again.
    fn quarantine(&mut self, name: &str, reason: &str) -> Vec<Command> {
        let now = self.now;
        let Some(member) = self.members.get_mut(name).filter(|member| member.quarantined_at.is_none()) else {
            return Vec::new();
        };
        member.quarantined_at = Some(now);
        self.fault(name, None, reason)
    }

    /// The same for the plans of one workload: what a session asks for takes a node from no other. A node that is dead for all
    /// workloads answers no liveness probe.
    fn exclude(&mut self, number: u64, name: &str, reason: &str) -> Vec<Command> {
        let now = self.now;
        let is_usable = self.usable().any(|(usable, _)| usable == name);
        let Some(workload) =
            self.workloads.get_mut(&number).filter(|workload| is_usable && !workload.excluded.contains_key(name))
        else {
            return Vec::new();
        };
        workload.excluded.insert(name.to_owned(), now);
        self.fault(name, Some(number), reason)
    }

    fn fault(&mut self, name: &str, workload_number: Option<u64>, reason: &str) -> Vec<Command> {
        self.reports.forget(workload_number, name);
        let quarantine = Command::Quarantine { node_name: name.to_owned(), workload_number, reason: reason.to_owned() };
        let mut commands = vec![quarantine];
        commands.extend(self.nodes_changed(&format!("node {name} {reason}")));
        commands
    }

    /// Ends quarantines that have lasted. Nodes then wait for a role as if they had just joined.
    pub(super) fn readmit(&mut self) -> Vec<Command> {
        let now = self.now;
        let all_are_planned =
            !self.workloads.is_empty() && self.workloads.values().all(|workload| workload.active_plan.is_some());
        let mut commands = Vec::new();
        for (name, member) in &mut self.members {
            if member.quarantined_at.is_some_and(|since| has_lasted(now, since, all_are_planned)) {
                member.quarantined_at = None;
                commands.push(Command::Readmit { node_name: name.clone(), workload_number: None });
            }
        }
        for (&number, workload) in &mut self.workloads {
            let is_planned = workload.active_plan.is_some();
            let ended = workload.excluded.extract_if(.., |_, since| has_lasted(now, *since, is_planned));
            commands.extend(ended.map(|(node_name, _)| Command::Readmit { node_name, workload_number: Some(number) }));
        }
        if !commands.is_empty() {
            commands.extend(self.nodes_changed("a quarantine ended"));
        }
        commands
    }

    /// Whether a compositor may report a sampler: both have these roles in the plan in force.
    #[must_use]
    pub fn admits_report(&self, report: &SamplerReport) -> bool {
        let mut plans = self.workloads.values().filter_map(|workload| workload.active_plan.as_ref());
        plans.any(|active| active.concerns(report))
    }

    pub(super) fn reported(&mut self, report: SamplerReport) -> Vec<Command> {
        if !self.admits_report(&report) {
            return Vec::new();
        }
        let SamplerReport { plan_epoch, compositor, sampler, reason } = report.clone();
        let Some(number) = self.workload_of_plan(plan_epoch) else { return Vec::new() };
        if self.reports.file(self.now, number, report) {
            return self.exclude(number, &sampler, &format!("sends no images to {compositor} and others: {reason}"));
        }
        self.probe_image(plan_epoch, &sampler).into_iter().collect()
    }

    /// One probe of a sampler at a time. Each report on file has another image fetched.
    fn probe_image(&mut self, plan_epoch: u64, sampler: &str) -> Option<Command> {
        let workload_number = self.workload_of_plan(plan_epoch)?;
        let number = self.reports.count_of(workload_number, sampler).saturating_sub(1);
        let member = self.members.get(sampler)?;
        let incarnation = member.incarnation;
        let address = member.status.address.clone();
        let estimate = member.estimates.get(&workload_number)?;
        let sample_image_s = estimate.now().costs.sample_image_s;
        let (_, active) = self.active_plan_for(plan_epoch, sampler)?;
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
        let Some((number, active)) = self.active_plan_for(plan_epoch, sampler) else { return Vec::new() };
        if !active.probed_samplers.remove(sampler) {
            return Vec::new();
        }
        if let Some(reason) = failure {
            return self.exclude(number, sampler, &format!("sends no images: {reason}"));
        }
        let at_fault = self.reports.refute(number, sampler).into_iter().map(|(compositor, reason)| {
            self.exclude(number, &compositor, &format!("reports samplers whose images can be had: {reason}"))
        });
        at_fault.flatten().collect()
    }

    /// Every node that has taken a plan in force is probed at this interval.
    pub(super) fn probe_liveness(&mut self) -> Vec<Command> {
        let plans: Vec<&ActivePlan> = self.workloads.values().filter_map(|w| w.active_plan.as_ref()).collect();
        if plans.is_empty() || self.now.saturating_sub(self.liveness_probed_at) < LIVENESS_INTERVAL {
            return Vec::new();
        }
        let probes = self.members.iter().filter_map(|(name, member)| {
            let active = plans.iter().find(|active| active.ready.contains(name))?;
            Some(Command::Probe(Box::new(Probe {
                plan_epoch: active.epoch(),
                node_name: name.clone(),
                incarnation: member.incarnation,
                address: member.status.address.clone(),
                image: None,
                deadline: PROBE_DEADLINE,
            })))
        });
        let commands = probes.collect();
        self.liveness_probed_at = self.now;
        commands
    }
}

/// A node is tried again sooner where there is no plan without it.
fn has_lasted(now: Duration, since: Duration, is_planned: bool) -> bool {
    now.saturating_sub(since) >= if is_planned { QUARANTINE } else { QUARANTINE_WITHOUT_PLAN }
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
