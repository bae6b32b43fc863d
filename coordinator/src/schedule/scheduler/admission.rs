//! Admission: what a session may ask for, beside what is promised to others.

use cluster::Workload;
use cluster::limits::MAX_CELLS;
use depth_image::PinholeCamera;

use super::Scheduler;
use crate::schedule::budgeted::Budgeted;
use crate::schedule::choose::check;
use crate::schedule::workload_state::WorkloadState;
use crate::schedule::{ChoiceError, Demand, NodeCosts, Opening, PolicyOverride, choose};

/// The share of the nodes' time that admitted sessions may take at their last fallback. Costs are measured alone and in even
/// batches, and are higher among many viewers.
const MOST_ADMITTED: f64 = 0.9;

impl Scheduler {
    /// Whether a session is open and planned.
    #[must_use]
    pub fn has_session(&self, session: u64) -> bool {
        self.workload_of_session(session).is_some()
    }

    /// Whether a session may ask for this many views from now on, and look from these viewpoints where they are given. A
    /// session may always ask for less than before.
    ///
    /// # Errors
    /// As for one that is opened; with viewpoints, also for one that has sample cameras of its own.
    pub fn admits(
        &self,
        session: u64,
        views_per_set: usize,
        frames_per_s: Option<f64>,
        viewpoints: Option<&[PinholeCamera]>,
    ) -> Result<(), ChoiceError> {
        let Some(number) = self.workload_of_session(session) else { return Ok(()) };
        let before = &self.workloads[&number];
        // A cube serves views from anywhere.
        if viewpoints.is_some() && before.cell_count().is_none() && !before.requested.samples_cube() {
            return Err(ChoiceError::NoCells { session });
        }
        // Together: rate and cells multiply.
        let after = before.changed(self.now, |sessions| {
            sessions.set_demand(session, views_per_set, frames_per_s);
            if let Some(viewpoints) = viewpoints {
                sessions.set_viewpoints(session, viewpoints);
            }
        });
        let asks_for_more_views = after.sessions.views_per_s() > before.sessions.views_per_s();
        let needs_more_images = after.cell_count() > before.cell_count() || after.load().images > before.load().images;
        if asks_for_more_views || (viewpoints.is_some() && needs_more_images) {
            self.admit(Some((number, before)), &after, &self.costs_to_admit(number, &after.costs))?;
        }
        Ok(())
    }

    /// Whether a workload is open that a session without a budget can share.
    #[must_use]
    pub fn has_workload(&self, workload: &Workload, follows_viewers: bool) -> bool {
        self.workloads.values().any(|open| open.is_shared_by(workload, None, follows_viewers))
    }

    /// Whether a session of this workload may be opened, as far as is known before its costs and planes are.
    ///
    /// # Errors
    /// Where it would be one workload too many.
    pub fn admits_workload(
        &self,
        workload: &Workload,
        budgeted: Option<&Budgeted>,
        follows_viewers: bool,
    ) -> Result<(), ChoiceError> {
        let is_open = self.workloads.values().any(|open| open.is_shared_by(workload, budgeted, follows_viewers));
        if is_open || self.workloads.len() < self.limits.max_workloads {
            return Ok(());
        }
        Err(ChoiceError::Workloads { most: self.limits.max_workloads })
    }

    /// The workload that a session belongs to, if it is open.
    pub(super) fn workload_for(&self, opening: &Opening) -> Option<u64> {
        let mut open = self.workloads.iter().filter(|(_, open)| {
            open.is_shared_by(&opening.workload, opening.budgeted.as_ref(), !opening.viewpoints.is_empty())
        });
        open.next().map(|(&number, _)| number)
    }

    /// Whether a session can be served.
    pub(super) fn check(&self, opening: &Opening) -> Result<(), ChoiceError> {
        let alone = self.costs_alone(opening);
        let Some(number) = self.workload_for(opening) else {
            self.admits_workload(&opening.workload, opening.budgeted.as_ref(), !opening.viewpoints.is_empty())?;
            return self.admit(None, &WorkloadState::new(self.now, opening), &alone);
        };
        let before = &self.workloads[&number];
        let forced = opening.policy_override;
        if forced != PolicyOverride::default() && !before.sessions.all_force(forced) {
            return Err(ChoiceError::Override { in_force: before.sessions.policy_override() });
        }
        let after = before.changed(self.now, |sessions| sessions.add(opening));
        // It has to be possible without the others, too: they may leave.
        check(&Demand { load: after.load(), nodes: &alone, policy_override: forced, current: None })?;
        self.admit(Some((number, before)), &after, &self.costs_to_admit(number, &after.costs))
    }

    /// Costs of all usable nodes before any has worked for a session.
    pub(super) fn costs_alone(&self, opening: &Opening) -> Vec<NodeCosts> {
        vec![NodeCosts { costs: opening.costs, ..NodeCosts::default() }; self.usable().count()]
    }

    /// Whether a workload as it would be can be served by nodes with these costs, which are all usable ones: its sessions with a
    /// rate beside all others, at their last fallback. `before` is the open workload that it is of, with its number.
    fn admit(
        &self,
        before: Option<(u64, &WorkloadState)>,
        after: &WorkloadState,
        nodes: &[NodeCosts],
    ) -> Result<(), ChoiceError> {
        let policy_override = after.policy_override();
        check(&Demand { load: after.load(), nodes, policy_override, current: None })?;
        if let Some(cells) = after.cell_count().filter(|&cells| cells > MAX_CELLS) {
            return Err(ChoiceError::Cells { cells });
        }
        let own = before.map_or(0.0, |(number, workload)| self.promised_to(number, workload));
        let left = before.map_or(0.0, |(_, workload)| self.without_fallbacks(workload, after, nodes.len()));
        let asked = promised(after, nodes).max(left);
        // Batches take what is left, and add nothing to what is promised.
        if asked <= own {
            return Ok(());
        }
        let others = self.workloads.iter().filter(|(number, _)| before.is_none_or(|(own, _)| own != **number));
        let needed = others.map(|(&number, workload)| self.promised_to(number, workload)).sum::<f64>() + asked;
        if needed > MOST_ADMITTED { Err(ChoiceError::Overload { needed }) } else { Ok(()) }
    }

    /// What is promised to the sessions of an open workload.
    fn promised_to(&self, number: u64, workload: &WorkloadState) -> f64 {
        promised(workload, &self.costs_to_admit(number, &workload.costs))
    }

    /// The share of the nodes' time at the last fallback that is left, where a session does not accept the one in force:
    /// it took as much when it was left.
    fn without_fallbacks(&self, before: &WorkloadState, after: &WorkloadState, nodes: usize) -> f64 {
        match before.overload.view_utilisation_when_left(after.overload.step) {
            Some(view_utilisation) if !before.is_idle(self.now) => {
                let own_nodes = before.nodes.len() as f64 / nodes.max(1) as f64;
                view_utilisation * after.sessions.views_per_s() * after.frame_rate_ratio() * own_nodes
            }
            _ => 0.0,
        }
    }
}

/// The share of all nodes' time that a workload's sessions with a rate take at their last fallback.
fn promised(workload: &WorkloadState, nodes: &[NodeCosts]) -> f64 {
    rated_set_s(workload, nodes).map_or(0.0, |time_s| workload.utilisation_at_last(time_s))
}

/// Seconds of a set's views of sessions with a rate; `None` without such sessions.
pub(super) fn rated_set_s(workload: &WorkloadState, nodes: &[NodeCosts]) -> Option<f64> {
    if workload.sessions.viewers() == 0 {
        return None;
    }
    let load = workload.rated_load();
    let policy_override = workload.policy_override().possible(&load, nodes.len());
    let of_viewers = nodes.iter().map(|node| NodeCosts { costs: workload.of_viewers(&node.costs), ..*node });
    let nodes: Vec<NodeCosts> = of_viewers.collect();
    // Nodes that can do none of it do not work for it.
    choose(&Demand { load, nodes: &nodes, policy_override, current: None }).ok().map(|choice| choice.time_s())
}
