//! View cells: views from all around, each made from images of near sample cameras.

use std::f32::consts::{PI, TAU};
use std::time::Duration;

use client::{Frame, ViewRequest};
use cluster::{PolicyChoice, SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, camera_around, request};
use cluster_tests::walkers::walk;
use depth_image::{PinholeCamera, ProvenanceKind};
use glam::UVec2;

const STILL: Timeline = Timeline { start_s: 1.0, step_s: 0.0, set_count: 1 };

fn view(azimuth_rad: f32) -> PinholeCamera {
    camera_around(azimuth_rad, 3.0, UVec2::new(48, 36))
}

fn looking_from(azimuths: impl IntoIterator<Item = f32>) -> SessionRequest {
    SessionRequest {
        viewpoints: azimuths.into_iter().map(view).collect(),
        forced_sampler_count: Some(1),
        ..request(PolicyChoice::Pipeline, STILL)
    }
}

fn requests(azimuths: impl IntoIterator<Item = f32>) -> Vec<ViewRequest> {
    let view = |(frame, azimuth)| ViewRequest { frame, set_index: 0, camera: view(azimuth) };
    (0..).zip(azimuths).map(view).collect()
}

/// The share of pixels that samples show; over a quarter is sky.
fn known(frame: &Frame) -> f64 {
    let provenance = frame.view.provenance.as_ref().unwrap();
    let hits = provenance.iter().filter(|pixel| pixel.kind() == ProvenanceKind::Hit).count();
    hits as f64 / provenance.len() as f64
}

async fn frames(session: &client::Session, azimuths: impl IntoIterator<Item = f32>) -> Vec<Frame> {
    let mut frames = session.render_views(requests(azimuths)).unwrap().all().await.unwrap();
    frames.sort_by_key(|frame| frame.request.frame);
    frames
}

fn around(count: usize) -> impl Iterator<Item = f32> {
    (0..count).map(move |i| TAU * i as f32 / count as f32)
}

/// One rig in front has no samples of the back: the curve falls. With cells it is level.
#[tokio::test(flavor = "multi_thread")]
async fn views_from_all_sides_are_equally_good() {
    let cluster = Cluster::start(4).await;
    let alone = SessionRequest { viewpoints: Vec::new(), ..looking_from([]) };
    let session = cluster.session(alone).await.unwrap();
    let of_rig: Vec<f64> = frames(&session, around(24)).await.iter().map(known).collect();
    drop(session);
    let session = cluster.session(looking_from(around(24))).await.unwrap();
    let plan = session.plan().assignment;
    let of_cells: Vec<f64> = frames(&session, around(24)).await.iter().map(known).collect();
    println!("{} cells of {} cameras in all", plan.workload.cell_count(), plan.workload.sample_cameras.len());
    println!("known from the front round: rig {of_rig:.2?}\ncells {of_cells:.2?}");
    assert!(plan.workload.cell_count() > 8);
    assert!(of_rig[..12].is_sorted_by(|a, b| a >= b) && of_rig[12] < 0.5 * of_rig[0], "{of_rig:?}");
    assert!(of_cells.iter().all(|known| (known / of_rig[0] - 1.0).abs() < 0.01), "{of_cells:?}");
    let images = plan.image_count();
    assert_eq!(cluster.take_counts(), vec![1; images], "each image once, for all compositors");
}

/// Changes elsewhere cause no sampling here.
#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_opens_or_closes_samples_no_other_cell_again() {
    let cluster = Cluster::start(3).await;
    let here = cluster.session(looking_from([0.0, 0.1])).await.unwrap();
    frames(&here, [0.0, 0.05, 0.1]).await;
    assert_eq!(cluster.take_counts(), [1, 1], "the ends");
    let there = cluster.session(looking_from([PI])).await.unwrap();
    let from_behind = frames(&there, [PI]).await;
    assert!(known(&from_behind[0]) > 0.5);
    assert_eq!(here.plan().assignment.plan_epoch, there.plan().assignment.plan_epoch);
    frames(&here, [0.0, 0.05, 0.1]).await;
    assert_eq!(cluster.take_counts(), [1], "the other's");
    drop(there);
    frames(&here, [0.02]).await;
    assert_eq!(cluster.take_counts(), [0; 0]);
}

#[tokio::test(flavor = "multi_thread")]
async fn cells_follow_a_viewer_that_walks_around() {
    let cluster = Cluster::start(3).await;
    let session = cluster.session(looking_from([0.0])).await.unwrap();
    let mut live = session.live();
    for step in 0..6 {
        let azimuth = step as f32;
        session.set_viewpoints(vec![view(azimuth)]).await.unwrap();
        // The cell of the live viewer's last pose stays until it has moved.
        let cells = || session.plan().assignment.workload.sample_cameras;
        let near = |camera: &depth_image::SampleCamera| {
            let reference = camera.depth().expect("a camera of a view").reference();
            (reference.eye_in_world - view(azimuth).eye_in_world).length() < 1e-3
        };
        cluster_tests::watcher::eventually("a cell here", Duration::from_secs(5), || cells().iter().any(near)).await;
        let number = live.set_pose(view(azimuth), 0).unwrap();
        let shown = loop {
            let frame = live.next().await.unwrap().frame;
            // A neighbouring cell's picture is followed by one of the own.
            if frame.request.frame >= number && !frame.header.is_neighbour_cell {
                break frame;
            }
        };
        assert!(known(&shown) > 0.5, "{azimuth}");
    }
    let own_cameras = cluster.session(request(PolicyChoice::Pipeline, STILL)).await.unwrap();
    let error = own_cameras.set_viewpoints(vec![view(0.0)]).await.unwrap_err().to_string();
    assert!(error.contains("was opened with sample cameras"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn walkers_who_change_cells_all_the_time_see_frames_all_the_time() {
    const SECONDS: u64 = 8;
    let walked = walk(&Cluster::start(4).await, 16, Duration::from_secs(SECONDS)).await;
    println!("{walked:?}");
    assert!(walked.sets_loaded >= 16 * SECONDS / 4, "they have entered new cells: {walked:?}");
    assert!(walked.plans > 0 && walked.plans as f64 <= walked.seconds + 1.0, "{walked:?}");
    assert_eq!(walked.wanted_fetches_ended, 0);
    // A pause that one would notice is longer than those of a busy machine.
    assert!(walked.longest_gap_s < 2.0, "{walked:?}");
}
