//! Sessions: admission, opening, closing, and changes of their demand.

use cluster::limits::MAX_CELLS;
use depth_image::{Camera, PinholeCamera};

use super::Scheduler;
use crate::schedule::choose::check;
use crate::schedule::workload_state::WorkloadState;
use crate::schedule::{ChoiceError, Command, Demand, NodeCosts, Opening, PolicyOverride, choose};

/// The share of the nodes' time that admitted sessions may take at their last fallback. Costs are measured alone and in even
/// batches, and are higher among many viewers.
const MOST_ADMITTED: f64 = 0.9;

/// The part of the demand that a plan follows at once.
fn plan_trigger(workload: &WorkloadState) -> (PolicyOverride, Vec<Camera>) {
    (workload.policy_override(), workload.requested.sample_cameras.clone())
}

impl Scheduler {
    fn check(&self, opening: &Opening) -> Result<(), ChoiceError> {
        let shared = self.workload.as_ref().filter(|workload| workload.is_shared_by(opening));
        let mut workload = shared.cloned().unwrap_or_else(|| WorkloadState::new(opening));
        workload.add(opening);
        if shared.is_some() {
            return admit(&workload, &self.costs_now());
        }
        let alone = NodeCosts { costs: opening.costs, ..NodeCosts::default() };
        // A node in quarantine for one workload may be able to do another.
        admit(&workload, &vec![alone; self.members.len()])
    }

    /// Whether a session is open and planned.
    #[must_use]
    pub fn has_session(&self, session: u64) -> bool {
        self.workload.as_ref().is_some_and(|workload| workload.sessions().contains(&session))
    }

    /// Whether a session may ask for this many views from now on. A session may always ask for less than before.
    ///
    /// # Errors
    /// As for one that is opened.
    pub fn admits(&self, session: u64, views_per_set: usize, frames_per_s: Option<f64>) -> Result<(), ChoiceError> {
        let Some(before) = &self.workload else { return Ok(()) };
        let mut workload = before.clone();
        workload.set_demand(session, views_per_set, frames_per_s);
        if workload.views_per_s() <= before.views_per_s() {
            return Ok(());
        }
        admit(&workload, &self.costs_now())
    }

    /// Whether a session may look from these viewpoints from now on.
    ///
    /// # Errors
    /// As for one that is opened, and for one that has sample cameras of its own.
    pub fn admits_viewpoints(&self, session: u64, viewpoints: &[PinholeCamera]) -> Result<(), ChoiceError> {
        let Some(before) = &self.workload else { return Ok(()) };
        let mut workload = before.clone();
        workload.set_viewpoints(session, viewpoints);
        match workload.cell_count() {
            None => Err(ChoiceError::NoCells { session }),
            Some(cells) if cells > MAX_CELLS && Some(cells) > before.cell_count() => Err(ChoiceError::Cells { cells }),
            Some(_) => Ok(()),
        }
    }

    pub(super) fn opened(&mut self, opening: &Opening) -> Vec<Command> {
        let session = opening.session;
        if let Err(error) = self.check(opening) {
            return vec![Command::Refuse { session, error }];
        }
        let mut commands = self.take_over(opening);
        let workload = self.workload.get_or_insert_with(|| WorkloadState::new(opening));
        let before = plan_trigger(workload);
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

    pub(super) fn demand_changed(&mut self, session: u64, views: usize, frames_per_s: Option<f64>) -> Vec<Command> {
        if let Some(workload) = &mut self.workload {
            workload.set_demand(session, views, frames_per_s);
        }
        self.reevaluate()
    }

    pub(super) fn viewpoints_changed(&mut self, session: u64, viewpoints: &[PinholeCamera]) -> Vec<Command> {
        let Some(workload) = &mut self.workload else { return Vec::new() };
        let before = plan_trigger(workload);
        workload.set_viewpoints(session, viewpoints);
        self.follow(before)
    }

    pub(super) fn closed(&mut self, session: u64) -> Vec<Command> {
        let Some(workload) = &mut self.workload else { return Vec::new() };
        let before = plan_trigger(workload);
        workload.remove(session);
        if workload.sessions().is_empty() {
            self.workload = None;
            return Vec::new();
        }
        self.follow(before)
    }

    /// Replans at once where another session decides or other images are sampled; else where it is worth it.
    fn follow(&mut self, (policy_override, sample_cameras): (PolicyOverride, Vec<Camera>)) -> Vec<Command> {
        let Some(workload) = &self.workload else { return Vec::new() };
        if workload.policy_override() != policy_override {
            self.replan("another session decides")
        } else if workload.requested.sample_cameras != sample_cameras {
            self.replan("sessions look from elsewhere")
        } else {
            self.reevaluate()
        }
    }
}

/// Whether a demand can be met; that of sessions with a rate, at their last fallback.
fn admit(workload: &WorkloadState, nodes: &[NodeCosts]) -> Result<(), ChoiceError> {
    let demand = Demand { load: workload.load(), nodes, policy_override: workload.policy_override(), current: None };
    check(&demand)?;
    if let Some(cells) = workload.cell_count().filter(|&cells| cells > MAX_CELLS) {
        return Err(ChoiceError::Cells { cells });
    }
    let least_ratio = workload.fallbacks().last().map_or(1.0, |quality| quality.frame_rate_ratio);
    let needed = workload.utilisation(choose(&demand)?.time_s()) * least_ratio / workload.frame_rate_ratio();
    if needed > MOST_ADMITTED { Err(ChoiceError::Overload { needed }) } else { Ok(()) }
}
