//! A real device that runs out of memory, or is lost, while a cluster delivers: no view is missing, and none differs.

use std::sync::Arc;

use app_core::addresses::listen;
use app_core::cluster::Cluster;
use app_core::delivery::{open, receive, request};
use app_core::process::runtime;
use app_core::setup::{SceneArgs, Setup};
use app_core::sizes::SampleSize;
use client::Session;
use cluster::PolicyChoice;
use coordinator::CoordinatorConfig;
use depth_image::{PinholeCamera, View, ViewCell};
use engine::GpuEngine;
use glam::UVec2;
use gpu::{DevicePreference, Gpu};

/// Views of one delivery.
const VIEWS: usize = 48;
const NODES: usize = 2;

struct Bench {
    setup: Setup,
    views: Vec<PinholeCamera>,
}

impl Bench {
    fn new() -> Self {
        let args = SceneArgs {
            sample_size: SampleSize::Fixed(UVec2::new(160, 120)),
            ..SceneArgs::new("courtyard".parse().unwrap())
        };
        let setup = args.load().unwrap();
        let views = ViewCell::between(&setup.samples).unwrap().spread(VIEWS, UVec2::new(96, 72));
        Self { setup, views }
    }

    async fn cluster(&self, engine: Arc<GpuEngine>) -> (Cluster, Session) {
        let listener = listen(([127, 0, 0, 1], 0).into(), false).await.unwrap();
        let offers = self.setup.offer.clone().into();
        let cluster = Cluster::start(|it| it, listener, CoordinatorConfig::default(), offers, engine.opener(), NODES)
            .await
            .unwrap();
        let client = cluster.client().await.unwrap();
        let request = request(self.setup.offer.settings.clone(), PolicyChoice::Pipeline, &self.views).unwrap();
        (cluster, open(&client, request).await.unwrap())
    }

    /// All views, in their order.
    async fn delivered(&self, session: &Session) -> Vec<View> {
        let mut frames = Vec::new();
        let received = async |frame| {
            frames.push(frame);
            Ok(())
        };
        receive(session, &self.views, received).await.unwrap();
        frames.sort_by_key(|frame| frame.request.frame);
        frames.into_iter().map(|frame| frame.view).collect()
    }
}

/// Delivers the views with the device as it is, and then after each of some faults. Returns the device.
fn deliver_after(faults: &[fn(&Gpu)]) -> Arc<Gpu> {
    let bench = Bench::new();
    let engine = Arc::new(GpuEngine::open(DevicePreference::Software).unwrap());
    let gpu = engine.renderer.gpu().clone();
    runtime().unwrap().block_on(async {
        let (cluster, session) = bench.cluster(engine).await;
        let expected = bench.delivered(&session).await;
        for (number, cause) in faults.iter().enumerate() {
            cause(&gpu);
            assert!(bench.delivered(&session).await == expected, "views differ after fault {number}");
        }
        drop(session);
        cluster.drain().await.unwrap();
    });
    gpu
}

#[test]
fn a_shortage_of_device_memory_costs_no_view() {
    let gpu = deliver_after(&[Gpu::inject_out_of_memory as fn(&Gpu); 4]);
    assert_eq!(gpu.shortages(), 4);
}

#[test]
fn a_lost_device_is_opened_again_and_costs_no_view() {
    let gpu = deliver_after(&[|gpu| gpu.device.destroy()]);
    assert_eq!(Arc::strong_count(&gpu), 1, "the lost device is in use");
}
