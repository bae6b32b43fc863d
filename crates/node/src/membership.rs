//! Membership: joining the coordinator, again after it was away. A device builds shaders and trees when it first needs them,
//! so a node does a little work before it joins.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{Assignment, JoinCluster, NodeStatus, Policy, Welcome, Workload};
use depth_image::{
    CubeGrid, LIGHT_FIELD_SIDES, LightDirections, LightFieldCamera, PinholeCamera, SampleCamera, Turn, ViewPlanes,
    WorkClass,
};
use glam::UVec2;
use tokio_stream::StreamExt as _;
use tonic::Status;
use wire::rpc::{Backoff, CoordinatorClient, connect};

use crate::auto_exposure::view_from_outside;
use crate::blocking::blocking;
use crate::engine::{DirectWork, Engine, EngineError, SampleSet, SampleWork, ViewWork, set_of_view};
use crate::parts::NodeParts;

/// The interval of a member's reports on its work.
const REPORT: Duration = Duration::from_secs(1);
/// The size of pictures that warm up: their content does not matter, and one tile of threads is enough.
const SIZE_PX: UVec2 = UVec2::splat(16);

/// The longest warm-up; a node that is still cold then joins all the same.
const WARM_UP_TIMEOUT: Duration = Duration::from_secs(120);

/// Stays a member until `shutdown`; frames go on while the coordinator is away.
pub async fn keep_membership(parts: Arc<NodeParts>, node: NodeStatus) {
    let coordinator = &parts.config.coordinator;
    let mut backoff = Backoff::reconnect();
    let mut warmed = false;
    loop {
        let mut joined = false;
        let request = JoinCluster { node: node.clone(), plan_epoch: parts.plans.epoch() };
        let ended = tokio::select! {
            ended = member(&parts, request, &mut warmed, &mut joined) => ended,
            () = parts.shutdown.cancelled() => return,
        };
        if joined {
            backoff.reset();
        }
        tracing::warn!(node = node.node_name, %coordinator, reason = ended.message(), "no longer a member");
        tokio::select! {
            () = tokio::time::sleep(backoff.next_delay()) => (),
            () = parts.shutdown.cancelled() => return,
        }
    }
}

/// One membership, until it ends, with the reason.
async fn member(parts: &Arc<NodeParts>, request: JoinCluster, warmed: &mut bool, joined: &mut bool) -> Status {
    let client = match connect(&parts.config.coordinator).await {
        Ok(channel) => CoordinatorClient::new(channel),
        Err(status) => return status,
    };
    if !std::mem::replace(warmed, true) {
        warm_up(&client, parts).await;
    }
    let mut stream = match client.join_cluster(request).await {
        Ok(stream) => stream,
        Err(status) => return status,
    };
    let mut reports = tokio::time::interval(REPORT);
    loop {
        tokio::select! {
            message = stream.next() => match message {
                Some(Ok(welcome)) => preload(welcome, parts.clone()),
                Some(Err(status)) => return status,
                None => return Status::ok("the coordinator ended it"),
            },
            _ = reports.tick(), if *joined => report(&client, parts).await,
        }
        *joined = true;
    }
}

/// Reports the work of each workload since the last report; a report that fails is not repeated.
async fn report(client: &CoordinatorClient, parts: &NodeParts) {
    for report in parts.metrics.done.take_reports(&parts.plans) {
        match tokio::time::timeout(REPORT, client.report_work(report)).await {
            Ok(Ok(())) => (),
            Ok(Err(status)) => tracing::debug!(reason = status.message(), "the report was refused"),
            Err(_) => return tracing::debug!("the report took too long"),
        }
    }
}

/// Loads offered scenes ahead; a plan that needs one waits for it.
fn preload(welcome: Welcome, parts: Arc<NodeParts>) {
    tokio::spawn(async move {
        for scene in welcome.scenes {
            if let Err(status) = parts.ensure_scene(&scene).await {
                tracing::warn!(scene = %scene.hash, reason = status.message(), "not loaded ahead");
            }
        }
    });
}

/// Does a little of the work of every plan in force, so that the next finds the node warm. No other node waits for it.
async fn warm_up(client: &CoordinatorClient, parts: &NodeParts) {
    // A node that has had a plan is warm.
    if parts.plans.epoch() > 0 {
        return;
    }
    let start = Instant::now();
    let warming = async {
        for served in client.get_status(()).await?.workloads.into_iter().filter_map(|workload| workload.plan) {
            parts.ensure_scene(&served.assignment.workload.scene).await?;
            let engine = parts.engine.clone();
            blocking(move || warm(engine.as_ref(), &served.assignment, served.method)).await?;
        }
        Ok::<_, Status>(())
    };
    match tokio::time::timeout(WARM_UP_TIMEOUT, warming).await {
        Ok(Ok(())) => tracing::debug!(seconds = start.elapsed().as_secs_f64(), "warm"),
        Ok(Err(status)) => tracing::warn!(reason = status.message(), "joins cold"),
        Err(_) => tracing::warn!(reason = "it took too long", "joins cold"),
    }
}

/// Makes one small picture of each kind that the plan has, its views by `method`.
fn warm(engine: &dyn Engine, plan: &Assignment, method: String) -> Result<(), EngineError> {
    let turn = Turn::of(WorkClass::Batch);
    let workload = small(&plan.workload.of_one_view());
    let view = any_view(&workload);
    if plan.policy == Policy::Direct {
        return engine.draw_direct(&DirectWork::of(&workload, vec![view], ViewPlanes::default()), turn).map(drop);
    }
    let mut sets = Vec::new();
    for (number, cell) in workload.cells().iter().enumerate() {
        let images = engine.sample(&SampleWork::of(cell), turn)?;
        let set = SampleSet::of(cell, images, workload.common_cell(number).is_some());
        sets.push(engine.upload(&set.map_err(|error| EngineError::Device(error.to_string()))?, turn)?);
    }
    let set = set_of_view(engine, &workload, sets)?;
    let work = ViewWork { cameras: vec![view], method, planes: ViewPlanes::default() };
    engine.reconstruct(set.as_ref(), &work, turn).map(drop)
}

fn small(workload: &Workload) -> Workload {
    let mut cube = CubeGrid::around(&workload.volume, SIZE_PX.x).into_iter().flat_map(|grid| grid.cameras());
    let sample_cameras = workload.sample_cameras.iter().map(|camera| match camera {
        SampleCamera::Layered(_) => cube.next().map_or(*camera, SampleCamera::from),
        // The smallest one.
        SampleCamera::LightField(field) => {
            LightFieldCamera::around(field.bounds, LightDirections::D66, *LIGHT_FIELD_SIDES.start()).into()
        }
        SampleCamera::Depth(_) => camera.resized(SIZE_PX),
    });
    Workload { sample_cameras: sample_cameras.collect(), ..workload.clone() }
}

/// The view of the first sample camera, or one from outside.
fn any_view(workload: &Workload) -> PinholeCamera {
    let first = SampleCamera::references(&workload.sample_cameras).first().copied();
    first.unwrap_or_else(|| view_from_outside(&workload.volume, SIZE_PX))
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroU32;

    use super::*;
    use crate::measure::tests::{SimulatedDevice, request};

    fn plan(policy: Policy) -> Assignment {
        Assignment {
            plan_epoch: 1,
            workload_number: 1,
            policy,
            workload: request(1).workload,
            samplers: Vec::new(),
            compositors: Vec::new(),
            tile_count: 1,
            relay_fanout: None::<NonZeroU32>,
            method: None,
            audit: None,
        }
    }

    #[test]
    fn a_warm_up_makes_one_picture_of_each_kind_in_the_plan() {
        for (policy, sampled, drawn) in [(Policy::Direct, 0, 1), (Policy::Pipeline, 1, 0), (Policy::TimeShare, 1, 0)] {
            let engine = SimulatedDevice::default();
            warm(&engine, &plan(policy), "joint_carve".to_owned()).unwrap();
            let calls = engine.calls.into_inner().unwrap();
            assert_eq!(
                (calls.refinements.len(), calls.uploads.len(), calls.drawn_views.len()),
                (sampled, sampled, drawn)
            );
        }
        let grid = CubeGrid::around(&request(1).workload.volume, 64).unwrap();
        let sample_cameras = [0, 1, 2].map(|axis| grid.camera(axis).into()).to_vec();
        let cube = small(&Workload { sample_cameras, ..request(1).workload });
        assert_eq!((cube.validate(), cube.sample_cameras[0].size_px()), (Ok(()), SIZE_PX));
        assert_eq!(any_view(&cube), view_from_outside(&cube.volume, SIZE_PX));
        assert!(small(&request(1).workload).sample_cameras.iter().all(|camera| camera.size_px() == SIZE_PX));
    }
}
