//! Sessions: opening, closing, and changes of their demand.

use depth_image::{Camera, PinholeCamera};

use super::Scheduler;
use crate::schedule::workload_state::WorkloadState;
use crate::schedule::{Command, Opening, PolicyOverride};

/// The part of the demand that a plan follows at once.
#[derive(PartialEq)]
struct PlanTrigger {
    policy_override: PolicyOverride,
    sample_cameras: Vec<Camera>,
}

impl PlanTrigger {
    fn of(workload: &WorkloadState) -> Self {
        let sample_cameras = workload.requested.sample_cameras.clone();
        Self { policy_override: workload.policy_override(), sample_cameras }
    }
}

impl Scheduler {
    pub(super) fn opened(&mut self, opening: &Opening) -> Vec<Command> {
        let session = opening.session;
        if let Err(error) = self.check(opening) {
            return vec![Command::Refuse { session, error }];
        }
        let mut commands = self.take_over(opening);
        let workload = self.workload.get_or_insert_with(|| WorkloadState::new(opening));
        let before = PlanTrigger::of(workload);
        workload.add(opening);
        commands.extend(self.follow(before));
        let is_announced = commands.iter().any(|command| matches!(command, Command::Apply { .. }));
        commands.extend(self.active_plan().filter(|_| !is_announced).map(|active| self.apply(active, vec![session])));
        commands
    }

    /// Ends sessions of another workload; costs are those of the new one from here on.
    fn take_over(&mut self, opening: &Opening) -> Vec<Command> {
        if self.workload.as_ref().is_some_and(|workload| workload.is_shared_by(opening)) {
            return Vec::new();
        }
        self.members.values_mut().for_each(|member| member.restart(&opening.costs));
        let reason = format!("plan {} took its place", self.plan_epoch + 1);
        let ended = self.workload.take().map(|workload| workload.sessions()).unwrap_or_default();
        ended.into_iter().map(|session| Command::End { session, reason: reason.clone() }).collect()
    }

    pub(super) fn demand_changed(
        &mut self,
        session: u64,
        views_per_set: usize,
        frames_per_s: Option<f64>,
    ) -> Vec<Command> {
        if let Some(workload) = &mut self.workload {
            workload.set_demand(session, views_per_set, frames_per_s);
        }
        self.reevaluate()
    }

    pub(super) fn viewpoints_changed(&mut self, session: u64, viewpoints: &[PinholeCamera]) -> Vec<Command> {
        let Some(workload) = &mut self.workload else { return Vec::new() };
        let before = PlanTrigger::of(workload);
        workload.set_viewpoints(session, viewpoints);
        self.follow(before)
    }

    pub(super) fn closed(&mut self, session: u64) -> Vec<Command> {
        let Some(workload) = &mut self.workload else { return Vec::new() };
        let before = PlanTrigger::of(workload);
        workload.remove(session);
        if workload.sessions().is_empty() {
            self.workload = None;
            return Vec::new();
        }
        self.follow(before)
    }

    /// Replans at once where another session decides or other images are sampled; else where it is worth it.
    fn follow(&mut self, before: PlanTrigger) -> Vec<Command> {
        let Some(now) = self.workload.as_ref().map(PlanTrigger::of) else { return Vec::new() };
        if now.policy_override != before.policy_override {
            self.replan("another session decides")
        } else if now.sample_cameras != before.sample_cameras {
            self.replan("sessions look from elsewhere")
        } else {
            self.reevaluate()
        }
    }
}
