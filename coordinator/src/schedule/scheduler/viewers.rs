//! View cells follow viewers: where sessions say that they look from, and where compositors see them.

use std::time::Duration;

use depth_image::PinholeCamera;

use super::Scheduler;
use crate::schedule::Command;
use crate::schedule::workload_state::WorkloadState;

/// The least time between two plans because viewers have moved, for all sessions together.
const CELLS_INTERVAL: Duration = Duration::from_secs(1);

impl Scheduler {
    /// Whether the places of a workload's live viewers matter: to its sample cameras, or to a promise.
    #[must_use]
    pub fn wants_viewpoints(&self, workload_number: u64) -> bool {
        let workload = self.workloads.get(&workload_number);
        workload.is_some_and(|workload| workload.cell_count().is_some()) || self.budgets.contains_key(&workload_number)
    }

    pub(super) fn viewpoints_changed(&mut self, session: u64, viewpoints: &[PinholeCamera]) -> Vec<Command> {
        let Some(number) = self.workload_of_session(session) else { return Vec::new() };
        self.moved(number, |workload| workload.sessions.set_viewpoints(session, viewpoints))
    }

    /// A compositor says where its live viewers are.
    pub(super) fn viewers_moved(&mut self, number: u64, node: String, viewpoints: Vec<PinholeCamera>) -> Vec<Command> {
        if !self.wants_viewpoints(number) || !self.members.contains_key(&node) {
            return Vec::new();
        }
        self.moved(number, |workload| workload.set_live_viewpoints(node, viewpoints))
    }

    fn moved(&mut self, number: u64, change: impl FnOnce(&mut WorkloadState)) -> Vec<Command> {
        let now = self.now;
        let Some(workload) = self.workloads.get_mut(&number) else { return Vec::new() };
        change(workload);
        workload.note_movement(now);
        self.follow_viewers()
    }

    /// Whether cells may change: not so soon after they did.
    pub(super) fn may_change_cells(&self) -> bool {
        self.cells_changed_at.is_none_or(|at| self.now.saturating_sub(at) >= CELLS_INTERVAL)
    }

    /// Places cells around the viewpoints of today, where that is due, and plans for those that are new.
    pub(super) fn follow_viewers(&mut self) -> Vec<Command> {
        if !self.may_change_cells() {
            return Vec::new();
        }
        let moved = self.workloads.iter_mut().filter(|(_, workload)| workload.viewers_have_moved);
        let changed = moved.filter_map(|(&number, workload)| {
            let before = workload.trigger();
            workload.update_cells();
            (workload.trigger() != before).then_some(number)
        });
        let changed: Vec<u64> = changed.collect();
        if changed.is_empty() {
            return Vec::new();
        }
        self.cells_changed_at = Some(self.now);
        changed.into_iter().flat_map(|number| self.replan(number, "sessions look from elsewhere")).collect()
    }
}
