//! Spoilt chunks of sample images are asked for again; a sampler that sends nothing else is replaced.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use client::Session;
use cluster::{PolicyChoice, Refinement, SamplerReport, SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, request, views};
use cluster_tests::mangler::{Mangler, Spoil};
use cluster_tests::picture::fault_of;
use cluster_tests::processes::number_of;
use cluster_tests::watcher::eventually;
use codec::{ChunkBody, SampleSetId};
use node::NodeConfig;
use wire::rpc::{CoordinatorClient, connect};

use super::{CLOSED, ONE_WITNESS, compositor_of, has_role, sampler_of};

const SPOILT: [(&str, Spoil); 8] = [
    ("corrupt", |c| c[1].body = ChunkBody::Data(vec![0; 30].into())),
    ("truncated", |c| drop(c.pop())),
    ("cut off", |c| c.truncate(1)),
    ("reordered", |c| c.swap(0, 1)),
    ("duplicated", |c| c.insert(1, c[0].clone())),
    ("outdated", |c| c.iter_mut().for_each(|c| c.sample_set_id.plan_epoch = 0)),
    ("of another set", |c| c.iter_mut().for_each(|c| c.sample_set_id = SampleSetId { index: 9999, ..c.sample_set_id })),
    ("of another image", |c| c.iter_mut().for_each(|c| c.image_index += 7)),
];

/// Every node has a mangler before it.
async fn start(nodes: usize) -> (Cluster, Vec<Mangler>) {
    let mut cluster = Cluster::start(0).await;
    let mut manglers = Vec::new();
    for number in 0..nodes {
        let mangler = Mangler::start().await;
        let advertised = Some(mangler.address.clone());
        cluster.add_node(|config| NodeConfig { advertised_address: advertised.clone(), ..config });
        mangler.stand_before(&cluster.nodes[number].address);
        manglers.push(mangler);
    }
    cluster.client.wait_for_nodes(nodes, CLOSED).await.unwrap();
    (cluster, manglers)
}

async fn session(cluster: &Cluster) -> Session {
    let timeline = Timeline { start_s: 0.0, step_s: 0.05, set_count: 100 };
    cluster.session(request(PolicyChoice::Pipeline, timeline)).await.unwrap()
}

/// Shows the views of a set that no node has; all must be right.
async fn show(session: &Session, set_index: u32) -> Duration {
    let start = Instant::now();
    let asked = views(set_index + 1, 3).into_iter().filter(move |view| view.set_index == set_index);
    let frames = session.render_views(asked).unwrap().all().await.unwrap();
    let numbers: BTreeSet<u64> = frames.iter().map(|frame| frame.request.frame).collect();
    assert_eq!((frames.len(), numbers.len()), (3, 3));
    for frame in &frames {
        assert_eq!(frame.header.sample_set_id.index, u64::from(set_index));
        assert_eq!(fault_of(frame, set_index as f32 * 0.05, Refinement::default()), None);
    }
    start.elapsed()
}

#[tokio::test(flavor = "multi_thread")]
async fn corrupt_chunks_are_fetched_again() {
    let (cluster, manglers) = start(2).await;
    let session = session(&cluster).await;
    show(&session, 0).await;
    let epoch = session.plan().assignment.plan_epoch;
    let sampler = number_of(&sampler_of(&session));
    // Some sets ahead are fetched ahead.
    for (number, (what, spoil)) in (1..).zip(SPOILT) {
        manglers[sampler].spoil(2, spoil);
        let took = show(&session, 10 * number).await;
        println!("{what} twice: frames after {:.2} s", took.as_secs_f64());
        assert!(took < CLOSED, "{what}: {took:?}");
        assert_eq!(manglers[sampler].left(), 0, "{what}");
    }
    assert_eq!(session.plan().assignment.plan_epoch, epoch, "no node was quarantined for it");
}

/// A changed byte on the way may end a stream as if it were complete.
#[tokio::test(flavor = "multi_thread")]
async fn frames_of_a_stream_that_ends_early_are_asked_for_again() {
    let (cluster, manglers) = start(2).await;
    let session = session(&cluster).await;
    show(&session, 0).await;
    let compositor = number_of(&compositor_of(&session));
    for (set_index, cut) in [(10, 1), (20, 2)] {
        manglers[compositor].cut(cut);
        let took = show(&session, set_index).await;
        println!("{cut} streams that end early: frames after {:.2} s", took.as_secs_f64());
        assert!(took < CLOSED, "{took:?}");
        assert_eq!(manglers[compositor].left(), 0, "{cut} streams");
    }
}

/// A sampler is replaced that sends nothing but spoilt chunks from now on.
async fn replaced(nodes: usize, (what, spoil): (&str, Spoil), deadline: Duration) {
    let (cluster, manglers) = start(nodes).await;
    let session = session(&cluster).await;
    show(&session, 0).await;
    let name = sampler_of(&session);
    manglers[number_of(&name)].spoil(usize::MAX, spoil);
    let took = show(&session, 50).await;
    println!("always {what}, {nodes} nodes: frames after {:.2} s, without {name}", took.as_secs_f64());
    assert!(took < deadline, "{what}: {took:?}");
    assert!(!has_role(&session, &name), "{what}");
    show(&session, 70).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sampler_that_sends_only_spoilt_chunks_is_replaced() {
    for spoilt in [SPOILT[0], SPOILT[1], SPOILT[5]] {
        replaced(3, spoilt, CLOSED).await;
    }
}

/// The coordinator's own probe confirms the report of the only compositor.
#[tokio::test(flavor = "multi_thread")]
async fn a_spoilt_sampler_is_replaced_without_a_second_compositor() {
    for spoilt in [SPOILT[0], SPOILT[6], SPOILT[7]] {
        replaced(2, spoilt, ONE_WITNESS).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn two_samplers_that_fail_within_a_minute_cost_their_compositor_nothing() {
    let (cluster, manglers) = start(3).await;
    let timeline = Timeline { start_s: 0.0, step_s: 0.05, set_count: 100 };
    let asked = SessionRequest { forced_sampler_count: Some(2), ..request(PolicyChoice::Pipeline, timeline) };
    let session = cluster.session(asked).await.unwrap();
    show(&session, 0).await;
    let honest = compositor_of(&session);
    let failing: Vec<String> = (0..3).map(|number| format!("n{number}")).filter(|name| *name != honest).collect();
    for (set_index, name) in (1..).zip(&failing) {
        manglers[number_of(name)].spoil(usize::MAX, SPOILT[0].1);
        let took = show(&session, 20 * set_index).await;
        println!("sampler {name} fails: frames after {:.2} s", took.as_secs_f64());
        assert!(took < ONE_WITNESS, "{took:?}");
        assert!(!has_role(&session, name) && has_role(&session, &honest), "{name} fails, {honest} does not");
    }
    show(&session, 80).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_compositor_whose_reports_no_probe_confirms_is_quarantined() {
    let (cluster, _manglers) = start(3).await;
    let session = session(&cluster).await;
    show(&session, 0).await;
    let liar = compositor_of(&session);
    let sampler = sampler_of(&session);
    let plan_epoch = session.plan().assignment.plan_epoch;
    let coordinator = CoordinatorClient::new(connect(&cluster.coordinator.address).await.unwrap());
    let report = || SamplerReport {
        plan_epoch,
        compositor: liar.clone(),
        sampler: sampler.clone(),
        reason: "nothing came".to_owned(),
    };
    coordinator.report_sampler(report()).await.unwrap();
    // The probe passes meanwhile.
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert_eq!(session.plan().assignment.plan_epoch, plan_epoch, "a single report changes nothing");
    coordinator.report_sampler(report()).await.unwrap();
    eventually("a plan without the compositor", CLOSED, || !has_role(&session, &liar)).await;
    assert!(has_role(&session, &sampler));
    show(&session, 50).await;
}
