//! Findings of audits for a workload, over all of its representations.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use cluster::AuditedView;
use depth_image::PinholeCamera;
use planner::Budget;

/// Audited viewpoints that are remembered for the next plan.
const MAX_POSES: usize = 32;
/// Viewers above the budget that are remembered.
const MAX_VIEWERS: usize = 64;
/// So many broken promises within this time are the last.
const MOST_BREAKS: usize = 3;
const BREAKS_WITHIN: Duration = Duration::from_secs(600);
/// A viewer that is where it was audited after this time stays there.
const STAYS_AFTER: Duration = Duration::from_secs(5);

/// Broken promises, viewers whose views are above the budget, and viewpoints for the next plan.
#[derive(Debug, Clone, Default)]
pub(super) struct Findings {
    /// The last audited viewpoints, the newest last.
    pub(super) poses: VecDeque<PinholeCamera>,
    /// The times of broken promises, the last one last.
    pub(super) breaks: Vec<Duration>,
    /// The promise that is broken, if another representation is not in force yet.
    pub(super) broken: Option<Broken>,
    viewers: BTreeMap<(String, u64), ViewerAbove>,
    /// Plans are for the audited viewpoints, too.
    joins_poses: bool,
    /// A plan is wanted that is for them.
    pub(super) is_to_be_planned: bool,
    /// Too many promises were broken.
    pub(super) is_given_up: bool,
}

/// A promise that audits have found to be broken.
#[derive(Debug, Clone)]
pub(super) struct Broken {
    /// The choice that was promised, and its budget.
    pub(super) choice_number: u64,
    pub(super) budget: Budget,
    /// The mean error that was found; `None` where the budget is not of a mean.
    pub(super) found_ratio: Option<f64>,
    pub(super) since: Duration,
    /// The finding and its consequence in words.
    pub(super) reason: String,
}

impl Broken {
    /// Whether the promise of a budget is broken with it.
    pub(super) fn is_of(&self, budget: &Budget) -> bool {
        let Some(found) = self.found_ratio else { return true };
        budget.implies(&self.budget) || budget.error().is_some_and(|term| term.most_ratio() < found)
    }
}

/// A viewer whose last audited view is above the budget.
#[derive(Debug, Clone)]
struct ViewerAbove {
    camera: PinholeCamera,
    error: String,
    since: Duration,
    is_planned_for: bool,
}

impl Findings {
    /// Notes an audited view; `error` in words if it is above the budget.
    pub(super) fn note(&mut self, now: Duration, node: &str, view: &AuditedView, error: Option<String>) {
        self.poses.push_back(view.camera);
        if self.poses.len() > MAX_POSES {
            self.poses.pop_front();
        }
        if view.is_part {
            return;
        }
        let viewer = (node.to_owned(), view.stream);
        let Some(error) = error else {
            self.viewers.remove(&viewer);
            return;
        };
        if self.viewers.len() < MAX_VIEWERS || self.viewers.contains_key(&viewer) {
            // A set of another moment is audited anew from the same place.
            let before = self.viewers.get(&viewer).filter(|before| before.camera == view.camera);
            let (since, is_planned_for) = before.map_or((now, false), |before| (before.since, before.is_planned_for));
            self.viewers.insert(viewer, ViewerAbove { camera: view.camera, error, since, is_planned_for });
        }
    }

    /// A promise is broken. Whether it is the last.
    pub(super) fn note_break(&mut self, now: Duration) -> bool {
        self.breaks.retain(|at| now.saturating_sub(*at) < BREAKS_WITHIN);
        self.breaks.push(now);
        (self.joins_poses, self.is_to_be_planned) = (true, true);
        self.breaks.len() >= MOST_BREAKS
    }

    /// The viewpoints that a plan has to be for, beside the view cells: those of viewers above the budget, and the last.
    pub(super) fn poses_to_join(&self) -> Vec<PinholeCamera> {
        if !self.joins_poses {
            return Vec::new();
        }
        let above = self.viewers.values().map(|viewer| viewer.camera);
        above.chain(self.poses.iter().copied()).collect()
    }

    /// Forgets viewers that have moved on, as `is_there` says of a node and a camera, and asks for a plan for those that
    /// stay.
    pub(super) fn follow_viewers(&mut self, now: Duration, is_there: impl Fn(&str, &PinholeCamera) -> bool) {
        self.viewers.retain(|(node, _), viewer| {
            now.saturating_sub(viewer.since) < STAYS_AFTER || is_there(node, &viewer.camera)
        });
        for viewer in self.viewers.values_mut().filter(|viewer| now.saturating_sub(viewer.since) >= STAYS_AFTER) {
            if !std::mem::replace(&mut viewer.is_planned_for, true) {
                (self.joins_poses, self.is_to_be_planned) = (true, true);
            }
        }
    }

    /// The errors of other views are of another representation.
    pub(super) fn forget_viewers(&mut self) {
        self.viewers.clear();
    }

    /// The number of viewers that stay where the error is above the budget.
    pub(super) fn viewers_above(&self, now: Duration) -> u32 {
        self.staying(now).count() as u32
    }

    fn staying(&self, now: Duration) -> impl Iterator<Item = (&(String, u64), &ViewerAbove)> {
        self.viewers.iter().filter(move |(_, viewer)| now.saturating_sub(viewer.since) >= STAYS_AFTER)
    }

    /// These viewers in words; empty without any.
    pub(super) fn broken_here(&self, now: Duration) -> String {
        let texts =
            self.staying(now).map(|((node, stream), viewer)| format!("viewer {stream} of {node}: {}", viewer.error));
        let texts: Vec<String> = texts.take(3).collect();
        if texts.is_empty() { String::new() } else { format!(" Broken here ({}).", texts.join("; ")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_promise_is_one_of_looser_budgets_that_are_exceeded_as_well() {
        let budget = |text: &str| text.parse::<Budget>().unwrap();
        let broken = |found_ratio| Broken {
            choice_number: 1,
            budget: budget("flip 0.05"),
            found_ratio,
            since: Duration::ZERO,
            reason: String::new(),
        };
        let is_of = |found, text: &str| broken(found).is_of(&budget(text));
        assert_eq!(["flip 0.04", "flip 0.05", "flip 0.1"].map(|text| is_of(Some(0.07), text)), [true, true, false]);
        assert_eq!(["flip 0.1", "flip 0.3"].map(|text| is_of(Some(0.2), text)), [true, false]);
        assert!(is_of(None, "flip 0.1") && !is_of(Some(0.07), "time 8ms"));
    }
}
