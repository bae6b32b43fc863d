//! Chunks of sample images that are not what they should be: asked for again, and whoever sends nothing else is left
//! out.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use client::Session;
use cluster::{PolicyChoice, Refinement, Timeline};
use cluster_tests::cluster::{Cluster, request, views};
use cluster_tests::mangler::{Mangler, Spoil};
use cluster_tests::picture::fault_of;
use cluster_tests::processes::number_of;
use codec::{ChunkBody, SampleSetId};
use node::NodeConfig;

use crate::{CLOSED, has_role, sampler_of};

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

/// Each node has a mangler before it.
async fn start(nodes: usize) -> (Cluster, Vec<Mangler>) {
    let (mut cluster, mut manglers) = (Cluster::start(0).await, Vec::new());
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

/// The views of a set that was not there before; all must be right.
async fn show(session: &Session, set_index: u32) -> Duration {
    let start = Instant::now();
    let asked = views(set_index + 1, 3).into_iter().filter(|view| view.set_index == set_index).collect();
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
async fn spoilt_chunks_are_fetched_again() {
    let (cluster, manglers) = start(2).await;
    let session = session(&cluster).await;
    show(&session, 0).await;
    let (epoch, sampler) = (session.plan().assignment.plan_epoch, number_of(&sampler_of(&session)));
    // Some sets ahead are fetched ahead.
    for (number, (what, spoil)) in (1..).zip(SPOILT) {
        manglers[sampler].spoil(2, spoil);
        let took = show(&session, 10 * number).await;
        println!("{what} twice: frames after {:.2} s", took.as_secs_f64());
        assert!(took < CLOSED, "{what}: {took:?}");
        assert_eq!(manglers[sampler].left(), 0, "{what}");
    }
    assert_eq!(session.plan().assignment.plan_epoch, epoch, "nobody was left out for it");
}

async fn left_out((what, spoil): (&str, Spoil)) {
    let (cluster, manglers) = start(3).await;
    let session = session(&cluster).await;
    show(&session, 0).await;
    let name = sampler_of(&session);
    manglers[number_of(&name)].spoil(usize::MAX, spoil);
    let took = show(&session, 50).await;
    println!("always {what}: frames after {:.2} s, without {name}", took.as_secs_f64());
    assert!(took < CLOSED, "{what}: {took:?}");
    assert!(!has_role(&session, &name), "{what}");
    show(&session, 70).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sampler_that_sends_only_spoilt_chunks_is_quarantined() {
    for spoilt in [SPOILT[0], SPOILT[1], SPOILT[5]] {
        left_out(spoilt).await;
    }
}
