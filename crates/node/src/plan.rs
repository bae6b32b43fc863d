//! The plans in force on this node, one of each workload, and the plan of one view cell.

use std::collections::VecDeque;
use std::ops::Deref;
use std::sync::Arc;

use cluster::limits::MAX_WORKLOADS;
use cluster::{ApplyPlan, Assignment, CommonCell, SetContent, Workload};
use codec::EncodedImage;
use parking_lot::Mutex;
use tokio::sync::watch;
use tonic::Status;
use wire::refuse_plan;
use wire::rpc::Messages;

use crate::latest::push_latest;

/// The last plans of a workload that are remembered.
const MAX_PLANS: usize = 8;

/// The node's name and the plans in force on it. Epochs of one workload only rise. Clones share them.
#[derive(Debug, Clone)]
pub struct PlansInForce {
    /// The name of this node.
    pub node_name: Arc<str>,
    plans: Arc<Mutex<Plans>>,
    /// The number of changes.
    changes: watch::Sender<u64>,
}

#[derive(Debug, Default)]
struct Plans {
    /// The one that was used last is the last.
    workloads: Vec<WorkloadPlans>,
    highest_epoch: u64,
    /// Plans of this epoch and of lower ones were forgotten together, and do not come back.
    forgotten_epoch: u64,
    /// The last plan that told which workloads are open.
    told: Option<ApplyPlan>,
}

#[derive(Debug)]
struct WorkloadPlans {
    number: u64,
    /// One at least; the last is in force, and the others were before it.
    plans: VecDeque<Arc<Assignment>>,
}

impl WorkloadPlans {
    fn in_force(&self) -> Option<&Arc<Assignment>> {
        self.plans.back()
    }

    fn of_epoch(&self, plan_epoch: u64) -> Option<&Arc<Assignment>> {
        self.plans.iter().find(|plan| plan.plan_epoch == plan_epoch)
    }
}

/// Whether a workload is the same, whatever its cameras, cells, lighting and planes: a fallback may change these. A
/// coordinator that was restarted may give a number to another workload.
fn goes_on(before: &Workload, after: &Workload) -> bool {
    before.scene == after.scene
        && before.timeline == after.timeline
        && before.volume == after.volume
        && before.background == after.background
        && before.illumination == after.illumination
        && before.refinement_steps == after.refinement_steps
}

impl Plans {
    /// The plans of a workload. This is a use of them.
    fn of(&mut self, workload_number: u64) -> Option<&mut WorkloadPlans> {
        let at = self.workloads.iter().position(|workload| workload.number == workload_number)?;
        self.workloads[at..].rotate_left(1);
        self.workloads.last_mut()
    }

    /// Whether a plan is new; an error where it may not replace the one in force.
    fn admits(&mut self, assignment: &Assignment) -> Result<bool, Status> {
        let number = assignment.workload_number;
        let plan_epoch = assignment.plan_epoch;
        if plan_epoch <= self.forgotten_epoch {
            return Err(Status::failed_precondition(format!("plan_epoch {plan_epoch} was forgotten")));
        }
        let told = self.told.as_ref().filter(|told| told.assignment.plan_epoch > plan_epoch);
        if told.is_some_and(|told| told.has_ended(number)) {
            return Err(Status::failed_precondition(format!("workload {number} has ended")));
        }
        let in_force = self.of(number).and_then(|workload| workload.in_force().cloned());
        let Some(in_force) = in_force else { return Ok(true) };
        let old = in_force.plan_epoch;
        if plan_epoch > old || *in_force == *assignment {
            return Ok(plan_epoch > old);
        }
        let reason = format!("plan_epoch {plan_epoch} of workload {number} does not replace {old}");
        Err(Status::failed_precondition(reason))
    }

    /// Forgets the workloads that have ended by the time of this plan; gives their numbers.
    fn forget(&mut self, plan: ApplyPlan) -> Vec<u64> {
        let told_epoch = self.told.as_ref().map_or(0, |told| told.assignment.plan_epoch);
        if plan.open_workloads.is_empty() || plan.assignment.plan_epoch < told_epoch {
            return Vec::new();
        }
        let ended = self.workloads.extract_if(.., |workload| plan.has_ended(workload.number));
        let ended = ended.map(|workload| workload.number).collect();
        self.told = Some(plan);
        ended
    }

    fn put(&mut self, assignment: Assignment) {
        self.highest_epoch = self.highest_epoch.max(assignment.plan_epoch);
        let number = assignment.workload_number;
        let assignment = Arc::new(assignment);
        if let Some(workload) = self.of(number) {
            if !workload.in_force().is_some_and(|before| goes_on(&before.workload, &assignment.workload)) {
                workload.plans.clear();
            }
            return push_latest(&mut workload.plans, assignment, MAX_PLANS);
        }
        if self.workloads.len() >= MAX_WORKLOADS {
            self.workloads.remove(0);
        }
        self.workloads.push(WorkloadPlans { number, plans: [assignment].into() });
    }
}

impl PlansInForce {
    /// No plan yet.
    #[must_use]
    pub fn new(node_name: &str) -> Self {
        Self { node_name: node_name.into(), plans: Arc::default(), changes: watch::Sender::new(0) }
    }

    /// The highest epoch of any workload so far; 0 before the first plan.
    #[must_use]
    pub fn epoch(&self) -> u64 {
        self.plans.lock().highest_epoch
    }

    /// A workload's plan in force.
    #[must_use]
    pub fn in_force(&self, workload_number: u64) -> Option<Arc<Assignment>> {
        self.plans.lock().of(workload_number)?.in_force().cloned()
    }

    /// Whether a plan may replace its workload's plan in force.
    ///
    /// # Errors
    /// `FAILED_PRECONDITION` for a lower epoch, or for another plan with the same.
    pub fn admits(&self, assignment: &Assignment) -> Result<(), Status> {
        self.plans.lock().admits(assignment).map(drop)
    }

    /// Puts a plan in force, and forgets the workloads that have ended; gives their numbers. The workload that was used
    /// longest ago leaves where there are too many.
    ///
    /// # Errors
    /// As [`PlansInForce::admits`].
    pub fn apply(&self, plan: ApplyPlan) -> Result<Vec<u64>, Status> {
        // Compared under the lock: of two plans that were prepared at the same time the higher one stays.
        let mut plans = self.plans.lock();
        let is_new = plans.admits(&plan.assignment)?;
        if is_new {
            plans.put(plan.assignment.clone());
        }
        let ended = plans.forget(plan);
        drop(plans);
        if is_new || !ended.is_empty() {
            self.changes.send_modify(|changes| *changes += 1);
        }
        Ok(ended)
    }

    /// Forgets all plans. One that is still being applied is refused.
    pub fn forget_all(&self) {
        let mut plans = self.plans.lock();
        plans.workloads.clear();
        plans.forgotten_epoch = plans.highest_epoch;
        drop(plans);
        self.changes.send_modify(|changes| *changes += 1);
    }

    /// Whether a plan in force has a set.
    #[must_use]
    pub fn have_set(&self, content: &SetContent, set_index: u32) -> bool {
        let plans: Vec<_> = self.plans.lock().workloads.iter().filter_map(|of| of.in_force().cloned()).collect();
        plans.iter().any(|plan| has_set(plan, content, set_index))
    }

    /// Resolves when `ends` holds for a workload's plan in force, or for its absence.
    pub async fn until(&self, workload_number: u64, ends: impl Fn(Option<&Arc<Assignment>>) -> bool) {
        let mut changes = self.changes.subscribe();
        while !ends(self.in_force(workload_number).as_ref()) {
            // This value owns a sender, which therefore outlives the wait.
            let _ = changes.changed().await;
        }
    }

    /// The plan that a caller names, if it is in force.
    ///
    /// # Errors
    /// `FAILED_PRECONDITION` where it is not the one in force, which the refusal names.
    pub fn require(&self, workload_number: u64, plan_epoch: u64) -> Result<Arc<Assignment>, Status> {
        self.find(workload_number, plan_epoch, |workload| workload.in_force().filter(|p| p.plan_epoch == plan_epoch))
    }

    /// The plan in force, for a caller that knows it or one before it: a stream goes on from plan to plan.
    ///
    /// # Errors
    /// As [`PlansInForce::require`], for a plan of which the one in force is no successor.
    pub fn follow(&self, workload_number: u64, plan_epoch: u64) -> Result<Arc<Assignment>, Status> {
        self.find(workload_number, plan_epoch, |workload| {
            workload.of_epoch(plan_epoch).and_then(|_| workload.in_force())
        })
    }

    /// The plan that a caller names, in force or before the one in force: a set that is being fetched outlives its plan.
    ///
    /// # Errors
    /// As [`PlansInForce::follow`].
    pub fn remembered(&self, workload_number: u64, plan_epoch: u64) -> Result<Arc<Assignment>, Status> {
        self.find(workload_number, plan_epoch, |workload| workload.of_epoch(plan_epoch))
    }

    fn find(
        &self,
        workload_number: u64,
        plan_epoch: u64,
        wanted: impl Fn(&WorkloadPlans) -> Option<&Arc<Assignment>>,
    ) -> Result<Arc<Assignment>, Status> {
        // The refusal is encoded after the lock is released: it holds a whole plan.
        let in_force = {
            let mut plans = self.plans.lock();
            let workload = plans.of(workload_number).map(|workload| &*workload);
            if let Some(plan) = workload.and_then(wanted) {
                return Ok(plan.clone());
            }
            workload.and_then(WorkloadPlans::in_force).cloned()
        };
        let refused = format!("plan_epoch {plan_epoch} of workload {workload_number} is not in force");
        match in_force {
            Some(plan) => Err(refuse_plan(&plan, format!("{refused} on {}, {} is", self.node_name, plan.plan_epoch))),
            None => Err(Status::failed_precondition(format!("{refused} on {}, none is", self.node_name))),
        }
    }
}

/// Whether a set is made under a plan, in any of its view cells.
#[must_use]
pub fn has_set(plan: &Arc<Assignment>, content: &SetContent, set_index: u32) -> bool {
    let mut cells = (0..plan.workload.cell_count() as u32).filter_map(|cell| CellPlan::of(plan, cell).ok());
    cells.any(|cell| cell.set_content(set_index).as_ref() == Some(content))
}

/// The plan of one cell, without the images of other cells. Clones share it.
#[derive(Debug, Clone)]
pub struct CellPlan {
    plan: Arc<Assignment>,
    /// Index into the plan's cells.
    pub cell: u32,
    /// It is a common cell: views are not made from it alone.
    pub is_common: bool,
}

impl CellPlan {
    /// The part of `plan` for one cell.
    ///
    /// # Errors
    /// For a cell beyond the plan's last.
    pub fn of(plan: &Arc<Assignment>, cell: u32) -> Result<Self, Status> {
        let cell_count = plan.workload.cell_count();
        let is_common = plan.workload.common_cell(cell as usize).is_some();
        if (cell, cell_count) == (0, 1) {
            return Ok(Self { plan: plan.clone(), cell, is_common });
        }
        let Some(own) = plan.of_cell(cell) else {
            return Err(Status::invalid_argument(format!("cell_index {cell} is beyond {cell_count} cells")));
        };
        Ok(Self { plan: Arc::new(own), cell, is_common })
    }

    /// The parts of `plan` for all common cells.
    pub fn of_common(plan: &Arc<Assignment>) -> Vec<(CommonCell, Self)> {
        let first = plan.workload.view_cell_count();
        let common = plan.workload.common_cells.iter().enumerate();
        common.filter_map(|(at, cell)| Some((cell.clone(), Self::of(plan, (first + at) as u32).ok()?))).collect()
    }
}

impl Deref for CellPlan {
    type Target = Assignment;

    fn deref(&self) -> &Assignment {
        &self.plan
    }
}

/// Relays a cell's set as a compositor fetches it: all its images with their indices, in the order they arrive. An error where
/// they are no longer buffered, and in the stream where their fetch fails.
pub type Relay = Arc<dyn Fn(&CellPlan, u32) -> Result<Messages<(u32, EncodedImage)>, Status> + Send + Sync>;

/// The refusal of a set that a plan's timeline does not have.
pub fn beyond_timeline(set_index: u32) -> Status {
    Status::invalid_argument(format!("set_index {set_index} is beyond the timeline"))
}

#[cfg(test)]
pub(crate) mod tests {
    use cluster::{CompositorShare, Policy};
    use depth_image::SampleCamera;
    use tonic::Code;

    use super::*;
    use crate::measure::tests::request;

    pub(crate) fn plan(workload_number: u64, plan_epoch: u64) -> Assignment {
        Assignment {
            plan_epoch,
            workload_number,
            policy: Policy::Pipeline,
            workload: request(1).workload,
            samplers: Vec::new(),
            compositors: Vec::new(),
            tile_count: 1,
            relay_fanout: None,
            method: None,
            audit: None,
        }
    }

    /// The same workload with other cameras, in another role and policy.
    fn moved(plan: Assignment) -> Assignment {
        let sample_cameras: Vec<SampleCamera> = plan.workload.sample_cameras.iter().rev().copied().collect();
        let workload = Workload { sample_cameras, cell_first_indices: vec![0], ..plan.workload };
        let share = CompositorShare { node_name: "n".to_owned(), address: "http://n".to_owned(), view_weight: 1 };
        Assignment { workload, policy: Policy::Direct, compositors: vec![share], ..plan }
    }

    /// A plan that does not tell which workloads are open.
    pub(crate) fn alone(assignment: Assignment) -> ApplyPlan {
        ApplyPlan { assignment, open_workloads: Vec::new() }
    }

    fn of_another_scene(plan: Assignment) -> Assignment {
        let scene = cluster::SceneRef { hash: cluster::SceneHash::of(b"another"), package_bytes: 7 };
        Assignment { workload: Workload { scene, ..plan.workload }, ..plan }
    }

    #[tokio::test]
    async fn a_wait_ends_with_the_plan_that_it_waits_for() {
        let plans = PlansInForce::new("n");
        plans.apply(alone(plan(1, 3))).unwrap();
        let waiting = plans.clone();
        let is_late = |plan: Option<&Arc<Assignment>>| plan.is_some_and(|plan| plan.plan_epoch > 3);
        let waits = tokio::spawn(async move { waiting.until(1, is_late).await });
        for other in [plan(2, 9), plan(1, 3)] {
            plans.apply(alone(other)).unwrap();
            tokio::task::yield_now().await;
            assert!(!waits.is_finished());
        }
        plans.apply(alone(plan(1, 10))).unwrap();
        waits.await.unwrap();
    }

    #[test]
    fn a_plan_with_a_lower_epoch_of_its_workload_is_refused() {
        let plans = PlansInForce::new("n");
        assert!(plans.require(1, 0).is_err(), "no plan yet");
        plans.apply(alone(plan(1, 3))).unwrap();
        plans.apply(alone(plan(1, 3))).unwrap();
        for refused in [plan(1, 2), moved(plan(1, 3))] {
            assert_eq!(plans.admits(&refused).unwrap_err().code(), Code::FailedPrecondition);
            assert_eq!(plans.apply(alone(refused)).unwrap_err().code(), Code::FailedPrecondition);
        }
        plans.apply(alone(plan(2, 1))).unwrap();
        plans.apply(alone(plan(1, 4))).unwrap();
        assert!(plans.require(1, 3).is_err() && plans.require(1, 5).is_err() && plans.require(2, 4).is_err());
        assert_eq!((plans.require(1, 4).unwrap().plan_epoch, plans.require(2, 1).unwrap().plan_epoch), (4, 1));
        assert_eq!(plans.epoch(), 4);
    }

    #[test]
    fn plans_that_were_forgotten_together_do_not_come_back() {
        let plans = PlansInForce::new("n");
        plans.apply(alone(plan(1, 3))).unwrap();
        plans.forget_all();
        assert!(plans.in_force(1).is_none());
        for late in [plan(1, 3), plan(2, 2)] {
            assert_eq!(plans.apply(alone(late)).unwrap_err().code(), Code::FailedPrecondition);
        }
        plans.apply(alone(plan(1, 4))).unwrap();
    }

    #[test]
    fn a_workload_that_goes_on_remembers_its_last_plans() {
        let plans = PlansInForce::new("n");
        plans.apply(alone(plan(1, 3))).unwrap();
        plans.apply(alone(moved(plan(1, 5)))).unwrap();
        assert_eq!(plans.follow(1, 3).unwrap().plan_epoch, 5);
        assert_eq!(*plans.remembered(1, 3).unwrap(), plan(1, 3));
        assert!(plans.follow(1, 4).is_err() && plans.follow(1, 6).is_err() && plans.remembered(1, 4).is_err());
        let in_force = wire::plan_in_force(&plans.require(1, 3).unwrap_err());
        assert_eq!(in_force.map(|plan| plan.plan_epoch), Some(5), "the refusal names it");
        (6..20).for_each(|epoch| drop(plans.apply(alone(plan(1, epoch))).unwrap()));
        assert!(plans.follow(1, 5).is_err() && plans.remembered(1, 11).is_err() && plans.follow(1, 12).is_ok());
        plans.apply(alone(of_another_scene(plan(1, 20)))).unwrap();
        assert!(plans.follow(1, 19).is_err() && plans.remembered(1, 19).is_err(), "it shows something else");
    }

    #[test]
    fn the_workload_that_was_used_longest_ago_leaves() {
        let plans = PlansInForce::new("n");
        let most = MAX_WORKLOADS as u64;
        (1..=most).for_each(|number| drop(plans.apply(alone(plan(number, number))).unwrap()));
        assert!(plans.in_force(1).is_some(), "it was used now");
        plans.apply(alone(plan(most + 1, most + 1))).unwrap();
        assert!(plans.in_force(2).is_none() && plans.in_force(1).is_some() && plans.in_force(most + 1).is_some());
    }

    #[test]
    fn workloads_that_have_ended_are_forgotten_whatever_comes_late() {
        let plans = PlansInForce::new("n");
        [plan(1, 3), plan(2, 4), plan(5, 6)].into_iter().for_each(|plan| drop(plans.apply(alone(plan)).unwrap()));
        let telling =
            |plan_epoch, open: &[u64]| ApplyPlan { open_workloads: open.to_vec(), ..alone(plan(1, plan_epoch)) };
        assert_eq!(plans.apply(telling(7, &[1, 5])).unwrap(), [2]);
        assert!(plans.in_force(2).is_none() && plans.in_force(5).is_some());
        assert!(plans.require(2, 4).unwrap_err().message().ends_with("none is"));
        let late = plans.apply(alone(plan(2, 5))).unwrap_err();
        assert_eq!((late.code(), late.message()), (Code::FailedPrecondition, "workload 2 has ended"));
        assert_eq!(plans.apply(telling(9, &[1, 5, 8])).unwrap(), [0; 0]);
        assert!(plans.apply(telling(8, &[1])).is_err(), "a plan of before is refused");
        assert!(plans.in_force(5).is_some(), "and its list does not count");
        plans.apply(alone(plan(8, 8))).unwrap();
        plans.apply(ApplyPlan { open_workloads: vec![1, 8], ..alone(plan(8, 10)) }).unwrap();
        let both = (plans.in_force(5).is_none(), plans.in_force(8).map(|plan| plan.plan_epoch));
        assert_eq!(both, (true, Some(10)));
        assert_eq!(plans.apply(alone(plan(1, 11))).unwrap(), [0; 0], "nothing is told");
        let content = plan(1, 1).set_content(0).unwrap();
        assert!(plans.have_set(&content, 0));
    }

    #[tokio::test]
    async fn a_wait_ends_with_its_workload() {
        let plans = PlansInForce::new("n");
        plans.apply(alone(plan(1, 3))).unwrap();
        let waiting = plans.clone();
        let waits = tokio::spawn(async move { waiting.until(1, |plan| plan.is_none()).await });
        tokio::task::yield_now().await;
        plans.apply(ApplyPlan { open_workloads: vec![2], ..alone(plan(2, 4)) }).unwrap();
        waits.await.unwrap();
    }

    #[test]
    fn a_plan_has_the_sets_of_all_its_cells() {
        let workload = request(1).workload;
        let cameras = [workload.sample_cameras.clone(), workload.sample_cameras.clone()].concat();
        let second = workload.sample_cameras.len() as u32;
        let both = Workload { sample_cameras: cameras, cell_first_indices: vec![0, second], ..workload.clone() };
        let both = Arc::new(Assignment { workload: both, ..plan(1, 1) });
        let content = plan(1, 1).set_content(0).unwrap();
        assert!(has_set(&both, &content, 0));
        assert!(!has_set(&Arc::new(of_another_scene(plan(1, 1))), &content, 0));
    }
}
