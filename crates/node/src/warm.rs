//! Warming up: a device builds shaders and trees when it first needs them, so a node does a little work before it joins.

use std::time::{Duration, Instant};

use cluster::{Assignment, Policy, Workload};
use depth_image::{Camera, ViewPlanes};
use glam::UVec2;
use tonic::Status;
use wire::rpc::CoordinatorClient;

use crate::blocking::blocking;
use crate::engine::{Engine, EngineError, ViewWork};
use crate::measure::{direct_work, sample_set, sample_work};
use crate::plan::CurrentPlan;
use crate::scenes::Scenes;

/// The size of pictures that warm up: their content does not matter, and one tile of threads is enough.
const SIZE_PX: UVec2 = UVec2::splat(16);

/// The longest warm-up; a node that is still cold then joins all the same.
const WARM_UP_TIMEOUT: Duration = Duration::from_secs(120);

/// Does a little of the cluster's present work, so that a plan finds the node warm. No other node waits for it.
pub(crate) async fn warm_up(client: &CoordinatorClient, scenes: &Scenes, plan: &CurrentPlan) {
    let start = Instant::now();
    match tokio::time::timeout(WARM_UP_TIMEOUT, do_a_little(client, scenes, plan)).await {
        Ok(Ok(())) => tracing::debug!(seconds = start.elapsed().as_secs_f64(), "warm"),
        Ok(Err(status)) => tracing::warn!(reason = status.message(), "joins cold"),
        Err(_) => tracing::warn!(reason = "it took too long", "joins cold"),
    }
}

async fn do_a_little(client: &CoordinatorClient, scenes: &Scenes, plan: &CurrentPlan) -> Result<(), Status> {
    let served = client.get_status(()).await?.plan.map(|plan| plan.assignment);
    // A node that has had a plan is warm.
    let Some(served) = served.filter(|_| plan.epoch() == 0) else { return Ok(()) };
    scenes.ensure(&served.workload.scene).await?;
    let engine = scenes.engine();
    blocking(move || warm(engine.as_ref(), &served)).await
}

/// Makes one small picture of each kind that the plan has.
fn warm(engine: &dyn Engine, plan: &Assignment) -> Result<(), EngineError> {
    let workload = small(&plan.workload.of_cell(0).unwrap_or_else(|| plan.workload.clone()));
    let Some(Camera::Pinhole(view)) = workload.sample_cameras.first().copied() else { return Ok(()) };
    if plan.policy == Policy::Direct {
        return engine.draw_direct(&direct_work(&workload, vec![view], ViewPlanes::default())).map(drop);
    }
    let set = engine.upload(&sample_set(&workload, engine.sample(&sample_work(&workload))?))?;
    let work = ViewWork { cameras: vec![view], method: workload.method.clone(), planes: ViewPlanes::default() };
    engine.reconstruct(set.as_ref(), &work).map(drop)
}

fn small(workload: &Workload) -> Workload {
    let camera = |Camera::Pinhole(camera): &Camera| Camera::Pinhole(camera.resized(SIZE_PX));
    Workload { sample_cameras: workload.sample_cameras.iter().map(camera).collect(), ..workload.clone() }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroU32;

    use super::*;
    use crate::measure::tests::{Sleeper, request};

    fn plan(policy: Policy) -> Assignment {
        Assignment {
            plan_epoch: 1,
            policy,
            workload: request(1).workload,
            samplers: Vec::new(),
            compositors: Vec::new(),
            tile_count: 1,
            relay_fanout: None::<NonZeroU32>,
        }
    }

    #[test]
    fn a_warm_up_makes_one_picture_of_each_kind_in_the_plan() {
        for (policy, sampled, drawn) in [(Policy::Direct, 0, 1), (Policy::Pipeline, 1, 0), (Policy::TimeShare, 1, 0)] {
            let engine = Sleeper::default();
            warm(&engine, &plan(policy)).unwrap();
            let calls = engine.calls.into_inner().unwrap();
            assert_eq!(
                (calls.refinements.len(), calls.uploads.len(), calls.drawn_views.len()),
                (sampled, sampled, drawn)
            );
        }
        assert!(small(&request(1).workload).sample_cameras.iter().all(|Camera::Pinhole(c)| c.size_px == SIZE_PX));
    }
}
