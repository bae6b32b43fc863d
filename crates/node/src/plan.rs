//! The plan in force on this node, whose epochs only rise, and the plan of one view cell.

use std::ops::Deref;
use std::sync::Arc;

use cluster::Assignment;
use codec::EncodedDepthImage;
use tokio::sync::watch;
use tonic::Status;
use wire::refuse_plan;
use wire::rpc::Messages;

/// The node's name and the plan in force on it.
#[derive(Debug, Clone)]
pub struct CurrentPlan {
    /// The name of this node.
    pub node_name: Arc<str>,
    plan: watch::Sender<Option<Arc<Assignment>>>,
}

impl CurrentPlan {
    /// No plan yet.
    #[must_use]
    pub fn new(node_name: &str) -> Self {
        Self { node_name: node_name.into(), plan: watch::Sender::new(None) }
    }

    /// The highest epoch so far; 0 before the first plan.
    #[must_use]
    pub fn epoch(&self) -> u64 {
        self.plan.borrow().as_ref().map_or(0, |plan| plan.plan_epoch)
    }

    /// The plan in force.
    #[must_use]
    pub fn in_force(&self) -> Option<Arc<Assignment>> {
        self.plan.borrow().clone()
    }

    /// Whether a plan may replace the one in force.
    ///
    /// # Errors
    /// `FAILED_PRECONDITION` for a lower epoch, or for another plan with the same.
    pub fn admits(&self, assignment: &Assignment) -> Result<(), Status> {
        let current = self.plan.borrow();
        let Some(current) = current.as_ref() else { return Ok(()) };
        let (old, new) = (current.plan_epoch, assignment.plan_epoch);
        if new > old || (new == old && **current == *assignment) {
            return Ok(());
        }
        Err(Status::failed_precondition(format!("plan_epoch {new} does not replace {old}")))
    }

    /// Puts a plan in force.
    ///
    /// # Errors
    /// As [`CurrentPlan::admits`].
    pub fn apply(&self, assignment: Assignment) -> Result<(), Status> {
        let mut result = Ok(());
        // Compared under the lock: of two plans that were prepared at the same time the higher one stays.
        self.plan.send_if_modified(|current| {
            let higher = current.as_ref().is_none_or(|current| assignment.plan_epoch > current.plan_epoch);
            let same = current.as_ref().is_some_and(|current| **current == assignment);
            if higher {
                *current = Some(Arc::new(assignment));
            } else if !same {
                result = Err(Status::failed_precondition(format!("plan_epoch {} is too late", assignment.plan_epoch)));
            }
            higher
        });
        result
    }

    /// Resolves when a later plan than `plan_epoch` is in force.
    pub async fn replaced(&self, plan_epoch: u64) {
        let later = |plan: &Option<Arc<Assignment>>| plan.as_ref().is_some_and(|plan| plan.plan_epoch > plan_epoch);
        // This value owns a sender, which therefore outlives the wait.
        let _ = self.plan.subscribe().wait_for(later).await;
    }

    /// The plan that a caller names, if it is in force.
    ///
    /// # Errors
    /// `FAILED_PRECONDITION` where it is not the one in force, which the refusal names.
    pub fn require(&self, plan_epoch: u64) -> Result<Arc<Assignment>, Status> {
        match self.in_force() {
            Some(plan) if plan.plan_epoch == plan_epoch => Ok(plan),
            Some(plan) => Err(refuse_plan(
                &plan,
                format!("plan_epoch {plan_epoch} is not in force on {}, {} is", self.node_name, plan.plan_epoch),
            )),
            None => Err(Status::failed_precondition(format!(
                "plan_epoch {plan_epoch} is not in force on {}, none is",
                self.node_name
            ))),
        }
    }
}

/// The plan of one view cell, without the images of other cells. Clones share it.
#[derive(Debug, Clone)]
pub struct CellPlan {
    plan: Arc<Assignment>,
    /// Index into the plan's view cells.
    pub cell: u32,
    /// The number of view cells of the whole plan.
    pub cell_count: usize,
}

impl CellPlan {
    /// The part of `plan` for one view cell.
    ///
    /// # Errors
    /// For a cell beyond the plan's last.
    pub fn of(plan: &Arc<Assignment>, cell: u32) -> Result<Self, Status> {
        let cell_count = plan.workload.cell_count();
        if (cell, cell_count) == (0, 1) {
            return Ok(Self { plan: plan.clone(), cell, cell_count });
        }
        let beyond = || Status::invalid_argument(format!("cell_index {cell} is beyond {cell_count} view cells"));
        Ok(Self { plan: Arc::new(plan.of_cell(cell).ok_or_else(beyond)?), cell, cell_count })
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
pub type Relay = Arc<dyn Fn(&CellPlan, u32) -> Result<Messages<(u32, EncodedDepthImage)>, Status> + Send + Sync>;

/// The refusal of a set that a plan's timeline does not have.
pub fn beyond_timeline(set_index: u32) -> Status {
    Status::invalid_argument(format!("set_index {set_index} is beyond the timeline"))
}

#[cfg(test)]
mod tests {
    use cluster::{Policy, SamplePlanes, SceneHash, SceneRef, Timeline, Workload};
    use depth_image::{Aabb, Illumination};
    use glam::Vec3;

    use super::*;

    fn plan(plan_epoch: u64, lighting: &str) -> Assignment {
        let workload = Workload {
            scene: SceneRef { hash: SceneHash::of(b""), package_bytes: 0 },
            sample_cameras: Vec::new(),
            cell_first_indices: Vec::new(),
            sampling: "conventional".to_owned(),
            lighting: lighting.to_owned(),
            planes: SamplePlanes::default(),
            volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
            background_linear: Vec3::ZERO,
            timeline: Timeline::still(0.0),
            illumination: Illumination::default(),
            refinement_steps: 1,
        };
        Assignment {
            plan_epoch,
            workload_number: 1,
            policy: Policy::Direct,
            workload,
            samplers: Vec::new(),
            compositors: Vec::new(),
            tile_count: 1,
            relay_fanout: None,
        }
    }

    #[tokio::test]
    async fn a_plan_is_replaced_by_a_later_one() {
        let current = CurrentPlan::new("n");
        current.apply(plan(3, "unlit")).unwrap();
        let waits = std::time::Duration::from_millis(20);
        assert!(tokio::time::timeout(waits, current.replaced(3)).await.is_err());
        current.replaced(2).await;
        let (waiting, later) = (current.clone(), current);
        let replaced = tokio::spawn(async move { waiting.replaced(3).await });
        later.apply(plan(4, "unlit")).unwrap();
        replaced.await.unwrap();
    }

    #[test]
    fn a_plan_with_a_lower_epoch_is_refused() {
        let current = CurrentPlan::new("n");
        assert!(current.require(0).is_err(), "no plan yet");
        current.apply(plan(3, "unlit")).unwrap();
        current.apply(plan(3, "unlit")).unwrap();
        for refused in [plan(2, "unlit"), plan(3, "phong")] {
            assert_eq!(current.admits(&refused).unwrap_err().code(), tonic::Code::FailedPrecondition);
            assert_eq!(current.apply(refused).unwrap_err().code(), tonic::Code::FailedPrecondition);
        }
        current.apply(plan(4, "phong")).unwrap();
        assert!(current.require(3).is_err() && current.require(5).is_err());
        assert_eq!((current.require(4).unwrap().plan_epoch, current.epoch()), (4, 4));
    }
}
