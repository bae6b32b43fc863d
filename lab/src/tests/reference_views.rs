//! The device behind a node, alone and in a cluster, against views drawn from the scene.

use std::sync::Arc;

use crate::reference_views::{self, ReferenceViews, encoded_and_decoded};
use app_core::addresses::listen;
use app_core::cluster::Cluster;
use app_core::delivery::{open, receive, request};
use app_core::process::runtime;
use app_core::setup::{SceneArgs, Setup};
use app_core::sizes::SampleSize;
use cluster::{PolicyChoice, SessionRequest, Workload};
use coordinator::CoordinatorConfig;
use depth_image::{Environment, PinholeCamera, SampleCamera, SampleImage, SampleImages, View, ViewCell, ViewPlanes};
use engine::GpuEngine;
use glam::UVec2;
use gpu::DevicePreference;
use node::{DirectWork, Engine as _, EngineError, SampleSet, SampleWork, Turn, ViewWork, WorkClass};
use reconstruction::ReconstructionMethod;

const TURN: Turn = Turn { class: WorkClass::Batch, flow: Turn::COMMON_FLOW };

const VIEW_SIZE: UVec2 = UVec2::new(64, 48);

fn args(scene: &str) -> SceneArgs {
    SceneArgs { sample_size: SampleSize::Fixed(UVec2::new(160, 120)), ..SceneArgs::new(fixtures::spec(scene).unwrap()) }
}

fn views(setup: &Setup, count: usize) -> Vec<PinholeCamera> {
    ViewCell::between(&setup.samples).unwrap().spread(count, VIEW_SIZE)
}

fn reference(scene: &str, count: usize) -> (Arc<GpuEngine>, SceneArgs, Setup, ReferenceViews) {
    let engine = GpuEngine::shared(DevicePreference::Any).unwrap();
    let args = args(scene);
    let setup = args.load().unwrap();
    let reference = ReferenceViews::draw(&engine, &setup, &args, views(&setup, count)).unwrap();
    (engine, args, setup, reference)
}

#[test]
fn views_from_samples_are_as_those_from_the_scene() {
    for scene in ["uv-sphere", "courtyard"] {
        let (_, _, _, reference) = reference(scene, 4);
        let row = reference.evaluate(ReconstructionMethod::default(), 1).unwrap();
        assert!(row.whole.psnr_db > 30.0, "{scene}: {row:?}");
        assert!(row.wrong_hits < 0.05 && row.unknown < 0.1, "{scene}: {row:?}");
        assert!(row.ms_a_view > 0.0, "{scene}: {row:?}");
    }
}

#[test]
fn the_comparison_sees_views_of_another_place() {
    let (engine, args, setup, reference) = reference("courtyard", 2);
    let own = reference.evaluate(ReconstructionMethod::default(), 1).unwrap();
    let mut moved = ReferenceViews::draw(&engine, &setup, &args, views(&setup, 6).split_off(4)).unwrap();
    moved.views.clone_from(&reference.views);
    let row = moved.evaluate(ReconstructionMethod::default(), 1).unwrap();
    let [moved, own] = [row.whole, own.whole];
    assert!(moved.psnr_db < own.psnr_db - 3.0 && moved.flip > 2.0 * own.flip, "{moved:?} {own:?}");
}

fn is_invalid(error: &EngineError, named: &str) -> bool {
    matches!(error, EngineError::InvalidArgument { field, .. } if *field == named)
}

#[test]
fn unknown_names_are_refused_with_their_field() {
    let (engine, args, setup, reference) = reference("uv-sphere", 1);
    let hash = setup.offer.hash.to_string();
    let samples: Vec<SampleCamera> = setup.samples.iter().copied().map(Into::into).collect();
    let sample = |scene_hash: &str, sampling: &str, lighting: &str| {
        engine
            .sample(
                &SampleWork {
                    scene_hash: scene_hash.to_owned(),
                    cameras: samples.clone(),
                    tile_count: 1,
                    wanted: vec![0, 1],
                    sampling: sampling.to_owned(),
                    planes: cluster::SamplePlanes::default(),
                    lighting: lighting.to_owned(),
                    scene_time_s: 0.0,
                    refinement: cluster::Refinement::default(),
                    surfaces_by_rays: None,
                },
                TURN,
            )
            .unwrap_err()
    };
    assert_eq!(sample("none", "conventional", "unlit"), EngineError::UnknownScene { hash: "none".to_owned() });
    assert!(is_invalid(&sample(&hash, "random", "unlit"), "sampling_method"));
    assert!(is_invalid(&sample(&hash, "conventional", "candles"), "lighting"));
    assert!(is_invalid(&sample(&hash, "layered_cube:64", "unlit"), "sample_cameras"));
    let set = SampleSet {
        scene_hash: hash.clone(),
        images: SampleImages::Depth(reference_views::sample(&engine, &setup, &args).unwrap()),
        volume: setup.offer.volume,
        background: Environment::default(),
        illumination: setup.offer.illumination.clone(),
        lighting: args.lighting.to_string(),
        scene_time_s: 0.0,
        traced_pixel_count: None,
        is_common: false,
    };
    let uploaded = engine.upload(&set, TURN).unwrap();
    let work = |method: &str, near_m: f32| ViewWork {
        cameras: vec![PinholeCamera { near_m, ..reference.cameras[0] }],
        method: method.to_owned(),
        planes: ViewPlanes::default(),
    };
    let refused = |work: &ViewWork| engine.reconstruct(uploaded.as_ref(), work, TURN).unwrap_err();
    assert!(is_invalid(&refused(&work("guess", 0.01)), "reconstruction_method"));
    assert!(is_invalid(&refused(&work("joint_carve", -1.0)), "camera"));
    assert!(is_invalid(
        &engine.upload(&SampleSet { images: SampleImages::Depth(Vec::new()), ..set }, TURN).err().unwrap(),
        "sample_images"
    ));
    assert!(is_invalid(&engine.load_scene("x", b"no package").unwrap_err(), "package"));
}

#[test]
fn a_package_loads_as_the_scene_does() {
    let (engine, _, setup, reference) = reference("unit-cube", 2);
    let package = scene::pack(&setup.scene);
    engine.load_scene("by package", &package).unwrap();
    assert!(engine.has_scene("by package"));
    let work = DirectWork {
        scene_hash: "by package".to_owned(),
        cameras: reference.cameras.clone(),
        lighting: "phong".to_owned(),
        scene_time_s: 0.0,
        planes: ViewPlanes::ALL,
        surfaces_by_rays: None,
    };
    let views = engine.draw_direct(&work, TURN).unwrap();
    assert_eq!(views.len(), reference.views.len());
    for (view, expected) in views.iter().zip(&reference.views) {
        // The faster of rays and triangles is chosen by timing for each package; they may differ at edges.
        let same = view.srgb8.iter().zip(&expected.srgb8).filter(|(a, b)| a == b).count();
        let share = same as f64 / expected.srgb8.len() as f64;
        assert!(view.size_px == expected.size_px && share > 0.98, "{share}");
    }
}

/// Views of a workload by one engine, which finds surfaces in the way that was measured to be faster for the workload.
fn views_of(
    engine: &GpuEngine,
    workload: &Workload,
    method: ReconstructionMethod,
    cameras: &[PinholeCamera],
) -> Vec<View> {
    let images = SampleImage::depth_images(engine.sample(&SampleWork::of(workload), TURN).unwrap()).unwrap();
    let decoded = images.iter().map(|image| encoded_and_decoded(image).map(SampleImage::Depth));
    let decoded: Vec<SampleImage> = decoded.collect::<Result<_, _>>().unwrap();
    let set = engine.upload(&SampleSet::of(workload, decoded, false).unwrap(), TURN).unwrap();
    let work = ViewWork { cameras: cameras.to_vec(), method: method.to_string(), planes: ViewPlanes::ALL };
    engine.reconstruct(set.as_ref(), &work, TURN).unwrap()
}

#[test]
fn a_cluster_gives_what_one_engine_gives() {
    let (engine, args, setup, reference) = reference("uv-sphere", 16);
    let (mut delivered, workload) = runtime().unwrap().block_on(async {
        let listener = listen(([127, 0, 0, 1], 0).into(), false).await.unwrap();
        let config = CoordinatorConfig::default();
        let cluster = Cluster::start(|it| it, listener, config, setup.offer.clone().into(), engine.clone().opener(), 3)
            .await
            .unwrap();
        let client = cluster.client().await.unwrap();
        let offer = client.status().await.unwrap().offers.remove(0);
        assert_eq!((&offer.sample_cameras, &offer.settings), (&setup.offer.rig, &setup.offer.settings));
        let request = request(offer.settings, PolicyChoice::Pipeline, &reference.cameras).unwrap();
        let request = SessionRequest { planes: ViewPlanes::ALL, ..request };
        let session = open(&client, request).await.unwrap();
        let plan = session.plan();
        assert!(plan.sampler_count() >= 1 && plan.assignment.compositors.len() + plan.sampler_count() == 3);
        let mut frames = Vec::new();
        let received = async |frame| {
            frames.push(frame);
            Ok(())
        };
        receive(&session, &reference.cameras, received).await.unwrap();
        drop((session, client));
        cluster.drain().await.unwrap();
        (frames, plan.assignment.workload.clone())
    });
    let alone = views_of(&engine, &workload, args.method(), &reference.cameras);
    delivered.sort_by_key(|frame| frame.request.frame);
    let views: Vec<_> = delivered.into_iter().map(|frame| frame.view).collect();
    assert_eq!(views.len(), 16);
    assert!(views == alone, "views of the cluster differ from the engine's");
}
