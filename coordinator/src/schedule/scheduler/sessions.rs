//! Sessions: opening, closing, and changes of their demand.

use cluster::Costs;

use super::admission::rated_set_s;
use super::{RESUMED_WITHIN, Scheduler};
use crate::schedule::session_mix::SessionMix;
use crate::schedule::workload_state::{PlanTrigger, WorkloadState};
use crate::schedule::{Command, Opening};

impl Scheduler {
    /// Numbers of all open workloads. None for a while after a restart: streams under plans of the coordinator before go on
    /// until their sessions are open again.
    #[must_use]
    pub fn open_workloads(&self) -> Vec<u64> {
        let is_resuming = self.resumed_at.is_some_and(|at| self.now.saturating_sub(at) < RESUMED_WITHIN);
        if is_resuming { Vec::new() } else { self.workload_numbers() }
    }

    pub(super) fn opened(&mut self, opening: &Opening) -> Vec<Command> {
        let session = opening.session;
        if let Err(error) = self.check(opening) {
            return vec![Command::Refuse { session, error }];
        }
        let Some(number) = self.workload_for(opening) else { return self.begin(opening) };
        let mut commands = self.change(number, |sessions| sessions.add(opening));
        let announced = self.workloads.get(&number).and_then(|workload| workload.announced.clone());
        commands.extend(
            announced.map(|(_, promise)| Command::Promise { sessions: vec![session], promise: Box::new(promise) }),
        );
        let is_announced = commands
            .iter()
            .any(|command| matches!(command, Command::Apply { plan, .. } if plan.assignment.workload_number == number));
        let workload = self.workloads.get(&number).filter(|_| !is_announced);
        let announced = workload.and_then(|workload| Some((workload, workload.active_plan.as_ref()?)));
        commands.extend(announced.map(|(workload, active)| self.apply(active, workload, vec![session])));
        commands
    }

    /// A workload begins with its first session. Its number is above those of a coordinator before, as its epochs are.
    fn begin(&mut self, opening: &Opening) -> Vec<Command> {
        let number = self.last_workload.max(self.plan_epoch) + 1;
        self.last_workload = number;
        let mut workload = WorkloadState::new(self.now, opening);
        if let Some(time_s) = rated_set_s(&workload, &self.costs_alone(opening)) {
            workload.begin_with_room(self.now, workload.utilisation(time_s));
        }
        let view_time_ratio = workload.view_time_ratio(workload.overload.step);
        let reconstruct_view_s = workload.costs.reconstruct_view_s * view_time_ratio;
        let expected = Costs { reconstruct_view_s, ..workload.costs };
        self.members.values_mut().for_each(|member| member.expect(number, &expected));
        self.workloads.insert(number, workload);
        self.nodes_changed(&format!("workload {number} began"))
    }

    pub(super) fn demand_changed(&mut self, session: u64, views: usize, frames_per_s: Option<f64>) -> Vec<Command> {
        let Some(number) = self.workload_of_session(session) else { return Vec::new() };
        self.change(number, |sessions| sessions.set_demand(session, views, frames_per_s))
    }

    pub(super) fn closed(&mut self, session: u64) -> Vec<Command> {
        let Some(number) = self.workload_of_session(session) else { return Vec::new() };
        let is_last = self.workloads[&number].sessions.numbers() == [session];
        if is_last { self.end(number) } else { self.change(number, |sessions| sessions.remove(session)) }
    }

    /// A workload ends; others get its nodes.
    pub(super) fn end(&mut self, number: u64) -> Vec<Command> {
        self.workloads.remove(&number);
        self.members.values_mut().for_each(|member| drop(member.estimates.remove(&number)));
        self.nodes_changed(&format!("workload {number} ended"))
    }

    /// Replans at once where sessions force something else, other images are sampled or another quality is left; else where
    /// it is worth it.
    fn change(&mut self, number: u64, change: impl FnOnce(&mut SessionMix)) -> Vec<Command> {
        let now = self.now;
        let may_change_cells = self.may_change_cells();
        let Some(workload) = self.workloads.get_mut(&number) else { return Vec::new() };
        let before = workload.trigger();
        workload.change(now, change);
        if may_change_cells {
            workload.update_cells();
        }
        let after = workload.trigger();
        let costs = workload.costs;
        if before.sample_cameras != after.sample_cameras {
            self.cells_changed_at = Some(now);
        }
        let estimates = self.members.values_mut().filter_map(|member| member.estimates.get_mut(&number));
        estimates.for_each(|estimate| estimate.rebase(&costs));
        match why(&before, &after) {
            Some(why) => self.replan(number, why),
            None => self.reevaluate(number),
        }
    }
}

/// Why a plan follows at once, if it does.
fn why(before: &PlanTrigger, after: &PlanTrigger) -> Option<&'static str> {
    if before.policy_override != after.policy_override {
        Some("sessions force something else")
    } else if before.sample_cameras != after.sample_cameras {
        Some("sessions look from elsewhere")
    } else {
        (before != after).then_some("a session does not accept that fallback")
    }
}
