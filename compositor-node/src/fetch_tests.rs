//! A sampler that sends corrupt chunks, over a real port.

use std::time::Duration;

use cluster::{ApplyPlan, Assignment, FetchImages, SamplePlanes, Workload};
use codec::{Chunk, ChunkBody, SampleSetId, encode_depth_image, split_into_chunks};
use depth_image::{Camera, DepthImage, Environment, Illumination, Light, LightPlanes, PinholeCamera, SpecularPlanes};
use glam::{UVec2, Vec3};
use tokio::net::TcpListener;
use tokio_stream::StreamExt as _;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use tonic::{Code, async_trait};
use wire::rpc::{Messages, Sampler, sampler_server};

use super::*;
use crate::test_support::{assignment, workload};

type Spoil = fn(&mut Vec<Chunk>);

fn camera() -> Camera {
    Camera::Pinhole(PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(16)))
}

/// Four lights: with the environment they take two planes of visibility.
fn illumination() -> Illumination {
    let lamp = Light::Point { position_in_world: Vec3::Y, intensity_linear: Vec3::ONE, radius_m: 0.1 };
    Illumination { lights: vec![lamp; 4], environment: Environment::uniform(Vec3::ONE) }
}

fn dull() -> DepthImage {
    DepthImage {
        camera: camera(),
        inverse_depth_per_m: vec![0.5; 256],
        color_rgb9e5: (0..256).collect(),
        normal_oct16: None,
        surface_id: None,
        specular: None,
        passed: None,
        corner_inverse_depth_per_m: None,
        light: None,
    }
}

/// An image with `visibilities` planes of visibility.
fn shiny(visibilities: usize) -> DepthImage {
    let specular = SpecularPlanes {
        reflectance_srgb8_roughness8: (0..256).rev().collect(),
        visibility8: vec![vec![u32::MAX; 256]; visibilities],
    };
    DepthImage { normal_oct16: Some(vec![7; 256]), specular: Some(specular), ..dull() }
}

/// An image with light in place of colour, and with `shares` planes of shares.
fn lit(shares: usize) -> DepthImage {
    let light = LightPlanes {
        triangle_normal_oct16: vec![3; 256],
        lamps_rgb9e5: (0..256).collect(),
        environment_rgb9e5: (0..256).rev().collect(),
        share8: vec![vec![u32::MAX; 256]; shares],
    };
    DepthImage { color_rgb9e5: Vec::new(), normal_oct16: Some(vec![7; 256]), light: Some(light), ..dull() }
}

/// Chunks of two images of set 0 of plan 5.
fn chunks_of(image: &DepthImage) -> Vec<Chunk> {
    let encoded = encode_depth_image(image).unwrap();
    let id = SampleSetId { plan_epoch: 5, index: 0 };
    (0..2).flat_map(|index| split_into_chunks(id, index, encoded.clone())).collect()
}

/// Chunks as they should be.
fn good_chunks() -> Vec<Chunk> {
    chunks_of(&dull())
}

/// Sends chunks as they are, and then is silent.
struct Script {
    chunks: Vec<Chunk>,
    stays_open: bool,
}

#[async_trait]
impl Sampler for Script {
    async fn fetch_sample_images(&self, _request: FetchImages) -> Result<Messages<Chunk>, Status> {
        let chunks = tokio_stream::iter(self.chunks.clone()).map(Ok);
        Ok(if self.stays_open { Box::pin(chunks.chain(tokio_stream::pending())) } else { Box::pin(chunks) })
    }
}

async fn fetched(chunks: Vec<Chunk>, stays_open: bool) -> Result<SampleSet, Status> {
    fetched_with_planes(SamplePlanes::default(), chunks, stays_open).await
}

async fn fetched_with_planes(planes: SamplePlanes, chunks: Vec<Chunk>, stays_open: bool) -> Result<SampleSet, Status> {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = format!("http://{}", listener.local_addr().unwrap());
    let shutdown = CancellationToken::new();
    let routes = Routes::new(sampler_server(Script { chunks, stays_open }));
    let _server = tokio::spawn(node::serve(listener, routes, false, shutdown.clone()));
    let share = SamplerShare { node_name: "n7".to_owned(), address, image_indices: vec![0, 1] };
    let sample_cameras = vec![camera().into(); 2];
    let workload = Workload { sample_cameras, planes, illumination: illumination(), ..workload() };
    let plan = Arc::new(Assignment { plan_epoch: 5, workload, samplers: vec![share], ..assignment() });
    let deadlines = Deadlines { chunk: Duration::from_millis(200), ..Deadlines::default() };
    let request = SetRequest { plan: CellPlan::of(&plan, 0).unwrap(), set_index: 0, relay: None };
    let plans = PlansInForce::new("n0");
    plans.apply(ApplyPlan { assignment: (*plan).clone(), open_workloads: Vec::new() }).unwrap();
    let fetched = Arc::new(Fetcher::new(plans, deadlines)).fetch(&request).await;
    shutdown.cancel();
    let set = fetched.map(|(set, _)| set);
    set.map_err(|failed| {
        assert_eq!(failed.sampler.as_deref(), Some("n7"));
        failed.status
    })
}

#[tokio::test]
async fn a_whole_set_is_fetched() {
    assert_eq!(fetched(good_chunks(), false).await.unwrap().images.depth().len(), 2);
}

#[tokio::test]
async fn planes_of_highlights_are_fetched() {
    for visibilities in [0, 2] {
        let set = fetched(chunks_of(&shiny(visibilities)), false).await.unwrap();
        assert_eq!(set.illumination, illumination());
        assert_eq!(set.images.depth(), [shiny(visibilities), shiny(visibilities)]);
    }
}

#[tokio::test]
async fn light_and_colour_are_fetched_where_the_plan_says_so() {
    let planes = SamplePlanes { normals: true, light: true, ..SamplePlanes::default() };
    for shares in [0, 2] {
        let set = fetched_with_planes(planes, chunks_of(&lit(shares)), false).await.unwrap();
        assert_eq!(set.images.depth(), [lit(shares), lit(shares)]);
    }
    let refused = [
        ("has light where colour is needed", fetched(chunks_of(&lit(2)), false).await),
        ("has colour where light is needed", fetched_with_planes(planes, good_chunks(), false).await),
        ("3 planes of shares for 4 lamps", fetched_with_planes(planes, chunks_of(&lit(3)), false).await),
    ];
    for (reason, refused) in refused {
        let refused = refused.expect_err(reason);
        assert_eq!(refused.code(), Code::DataLoss, "{refused}");
        assert!(refused.message().contains(reason), "{refused}");
    }
}

#[tokio::test]
async fn an_image_with_visibility_of_other_lights_is_refused() {
    for visibilities in [1, 3] {
        let refused = fetched(chunks_of(&shiny(visibilities)), false).await.expect_err("for other lights");
        assert_eq!(refused.code(), Code::DataLoss, "{refused}");
        assert!(refused.message().contains("planes of visibility for 4 lights"), "{refused}");
    }
}

#[tokio::test]
async fn corrupt_chunks_are_refused_with_the_name_of_the_sampler() {
    let spoilt: [(&str, Spoil); 8] = [
        ("corrupt", |c| c[1].body = ChunkBody::Data(vec![0; 30].into())),
        ("truncated", |c| drop(c.pop())),
        ("reordered", |c| c.swap(0, 1)),
        ("repeated", |c| c.insert(1, c[0].clone())),
        ("repeated image", |c| c.extend_from_within(0..2)),
        ("old plan", |c| c.iter_mut().for_each(|c| c.sample_set_id.plan_epoch = 4)),
        ("another set", |c| c.iter_mut().for_each(|c| c.sample_set_id.index = 1)),
        ("another image", |c| c.iter_mut().for_each(|c| c.image_index += 7)),
    ];
    for (what, spoil) in spoilt {
        let mut chunks = good_chunks();
        spoil(&mut chunks);
        let refused = fetched(chunks, false).await.expect_err(what);
        assert_eq!(refused.code(), Code::DataLoss, "{what}: {refused}");
        assert!(refused.message().contains("sampler n7"), "{what}: {refused}");
    }
}

#[tokio::test]
async fn chunks_after_the_deadline_are_not_waited_for() {
    let refused = fetched(good_chunks()[..3].to_vec(), true).await.expect_err("silent");
    assert_eq!(refused.code(), Code::DeadlineExceeded, "{refused}");
}
