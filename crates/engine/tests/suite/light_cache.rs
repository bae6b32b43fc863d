//! Views whose surfaces come from the scene and whose light comes from samples, through the engine.

use std::sync::OnceLock;

use cluster::{CommonCell, CommonKind, SamplePlanes};
use codec::{DecodeLimits, decode_depth_image, encode_depth_image};
use depth_image::{
    Antialias, Camera, CubeGrid, DepthImage, PinholeCamera, SampleCamera, SampleImages, View, ViewPlanes,
};
use glam::{UVec2, Vec3};
use node::{DirectWork, Engine, EngineError, SampleSet, SampleWork, Turn, UploadedSet, ViewWork, WorkClass};
use scene::Scene;

use crate::stage::{engine, light_set, loaded, sample_set};

const HASH: &str = "a lit courtyard";
const LIGHTING: &str = "soft 4, occlusion 4";
const TURN: Turn = Turn { class: WorkClass::Batch, flow: Turn::COMMON_FLOW };
const METHOD: &str = "light_cache";

#[test]
fn clusters_know_indirect_light_by_the_texts_that_are_parsed() {
    for text in
        ["soft 16, indirect 64", "soft 4,indirect\t1", "shadows,  indirect  8", "soft 16, occlusion 16", "unlit"]
    {
        let lighting: render::Lighting = text.parse().expect("lighting");
        assert_eq!(cluster::has_indirect_light(text), lighting.is_indirect(), "{text}");
        assert_eq!(cluster::has_indirect_light(&lighting.to_string()), lighting.is_indirect(), "{text}");
    }
}

fn scene() -> &'static Scene {
    static SCENE: OnceLock<Scene> = OnceLock::new();
    SCENE.get_or_init(|| loaded(HASH, "courtyard"))
}

fn camera(x_share: f32, size_px: UVec2) -> PinholeCamera {
    let bounds = scene().bounds();
    let center = (bounds.min + bounds.max) * 0.5;
    let size = bounds.size().max_element();
    let eye = center + Vec3::new(x_share, 0.5, 0.9) * size;
    PinholeCamera::looking_at(eye, center, Vec3::Y, 0.8, size_px)
}

fn view_camera() -> PinholeCamera {
    camera(0.05, UVec2::new(160, 120))
}

fn sample_cameras() -> [PinholeCamera; 2] {
    [-0.2, 0.3].map(|x| camera(x, UVec2::new(192, 144)))
}

/// The set as compositors decode it.
fn decoded_set() -> SampleSet {
    let set = light_set((HASH, scene()), &sample_cameras(), LIGHTING);
    let images = set.images.depth().iter().map(sent).collect();
    SampleSet { images: SampleImages::Depth(images), ..set }
}

fn sent(image: &DepthImage) -> DepthImage {
    let encoded = encode_depth_image(image).expect("encoded");
    decode_depth_image(&encoded.header, image.camera, &encoded.payload, &DecodeLimits::default()).expect("decoded")
}

fn work(method: &str) -> ViewWork {
    let planes = ViewPlanes { antialias: Antialias::of(2).expect("offered"), ..ViewPlanes::ALL };
    ViewWork { cameras: vec![view_camera()], method: method.to_owned(), planes }
}

fn view(set: &dyn UploadedSet, method: &str) -> View {
    engine().reconstruct(set, &work(method), TURN).expect("a view").remove(0)
}

fn direct(surfaces_by_rays: Option<bool>) -> View {
    let ViewWork { cameras, planes, .. } = work(METHOD);
    let scene_hash = HASH.to_owned();
    let lighting = LIGHTING.to_owned();
    let work = DirectWork { scene_hash, cameras, lighting, scene_time_s: 0.0, planes, surfaces_by_rays };
    engine().draw_direct(&work, TURN).expect("a view").remove(0)
}

fn refused(set: &dyn UploadedSet, method: &str) -> String {
    engine().reconstruct(set, &work(method), TURN).expect_err("refused").to_string()
}

#[test]
fn views_are_equal_again_and_beside_a_live_stream() {
    let set = engine().upload(&decoded_set(), TURN).expect("a set");
    let whole = view(set.as_ref(), METHOD);
    assert!(view(set.as_ref(), METHOD) == whole);
    let _stream = engine().live_stream();
    assert!(view(set.as_ref(), METHOD) == whole, "in slices");
}

fn sample_work(camera: SampleCamera) -> SampleWork {
    SampleWork {
        scene_hash: HASH.to_owned(),
        cameras: vec![camera],
        tile_count: 1,
        wanted: vec![0],
        sampling: "conventional".to_owned(),
        planes: SamplePlanes { light: true, ..SamplePlanes::default() },
        lighting: LIGHTING.to_owned(),
        scene_time_s: 0.0,
        refinement: cluster::Refinement::default(),
        surfaces_by_rays: Some(true),
    }
}

/// An image of light, whose surfaces are found by rays.
fn sampled(camera: SampleCamera) -> DepthImage {
    let images: SampleImages =
        engine().sample(&sample_work(camera), TURN).expect("an image").try_into().expect("an image");
    images.depth()[0].clone()
}

#[test]
fn tiles_of_light_are_the_whole_image() {
    scene();
    for camera in sample_cameras().map(Camera::from) {
        let tiles = (0..3).map(|number| sampled(SampleCamera::Depth(camera.tile(number, 3)))).collect();
        let joined = DepthImage::from_tiles(camera, tiles).expect("an image");
        let whole = sampled(SampleCamera::Depth(camera));
        let [of_tiles, of_whole] = [&joined, &whole].map(|image| image.light.as_ref().expect("light"));
        let differ = |a: &[u32], b: &[u32]| a.iter().zip(b).filter(|(a, b)| a != b).count();
        let most = whole.inverse_depth_per_m.len() / 1000;
        assert!(differ(&of_tiles.triangle_normal_oct16, &of_whole.triangle_normal_oct16) <= most);
        assert!(differ(&of_tiles.lamps_rgb9e5, &of_whole.lamps_rgb9e5) <= most);
        assert!(differ(&of_tiles.environment_rgb9e5, &of_whole.environment_rgb9e5) <= most);
        // A tile's rays are those of the image but for the last bits.
        let mut depths = joined.inverse_depth_per_m.iter().zip(&whole.inverse_depth_per_m);
        assert!(depths.all(|(a, b)| (a - b).abs() <= 1e-5 * b.abs()));
    }
}

#[test]
fn surfaces_are_found_as_the_plan_says_and_exact_views_are_direct_ones() {
    let count = |pixels: u32| SampleSet { traced_pixel_count: Some(pixels), ..decoded_set() };
    let pixels = view_camera().pixel_count() as u32;
    for (most, by_rays) in [(pixels, true), (pixels - 1, false)] {
        let set = engine().upload(&count(most), TURN).expect("a set");
        let exact = view(set.as_ref(), "light_cache:exact");
        assert!(exact.srgb8 == direct(Some(by_rays)).srgb8, "by rays: {by_rays}");
    }
    let ViewWork { cameras, planes, .. } = work(METHOD);
    let scene_hash = HASH.to_owned();
    let lighting = LIGHTING.to_owned();
    let work = DirectWork { scene_hash, cameras, lighting, scene_time_s: 0.0, planes, surfaces_by_rays: None };
    assert!(engine().traced_pixel_count(&work, TURN).expect("measured").is_some());
}

#[test]
fn the_parts_of_a_view_are_told_and_a_preview_has_single_rays() {
    let set = engine().upload(&decoded_set(), TURN).expect("a set");
    let known = |method: &str| {
        let parts = engine().light_parts(set.as_ref(), &work(method), TURN).expect("measured").expect("light");
        assert!(parts.surfaces_s > 0.0 && parts.draft_s > 0.0, "{parts:?}");
        parts.known_ratio
    };
    let [draft, fine] = ["light_cache:draft", "light_cache:fine"].map(known);
    assert!(0.2 < fine && fine < draft && draft <= 1.0, "{fine} {draft}");
    assert!((known("light_cache:exact")).abs() < 1e-9, "every point is lit in the view");
    let colored = engine().upload(&sample_set((HASH, scene()), &sample_cameras(), LIGHTING), TURN).expect("a set");
    assert_eq!(engine().light_parts(colored.as_ref(), &work("joint_carve"), TURN), Ok(None));
    let preview = |lighting: &str| engine().preview_lighting(lighting).expect("a lighting");
    assert_eq!(preview("soft 16, occlusion 64 0.5m, reflections 2"), "soft 1, occlusion 1 0.5m, reflections 2");
    assert_eq!(preview("phong"), "phong");
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let light = engine().upload(&decoded_set(), TURN).expect("a set");
    assert!(refused(light.as_ref(), "joint_carve").contains("light where joint_carve needs colour"));
    assert!(refused(light.as_ref(), "light_cache:best").contains("unknown reconstruction method"));
    let colored_set = sample_set((HASH, scene()), &sample_cameras(), LIGHTING);
    let colored = engine().upload(&colored_set, TURN).expect("a set");
    assert!(refused(colored.as_ref(), METHOD).contains("takes surfaces from the scene"));
    let mixed = [decoded_set().images.depth(), colored_set.images.depth()].concat();
    let mixed = SampleSet { images: SampleImages::Depth(mixed), ..colored_set.clone() };
    let error = engine().upload(&mixed, TURN).err().map(|error| error.to_string());
    assert_eq!(error.as_deref(), Some("sample_images: sample image 2: colour where light is needed"));
    let bounds = scene().bounds();
    let base = CommonCell { kind: CommonKind::Base, bounds, sampling: "layered_cube:8".to_owned() };
    let error = engine().with_common(light, vec![(base, colored)]).err().map(|error| error.to_string());
    assert!(error.as_deref().is_some_and(|error| error.contains("no mirror cells, base or blocks")), "{error:?}");
    let elsewhere = SampleSet { scene_hash: "elsewhere".to_owned(), ..decoded_set() };
    let error = engine().upload(&elsewhere, TURN).err();
    assert_eq!(error, Some(EngineError::UnknownScene { hash: "elsewhere".to_owned() }));
}

#[test]
fn samples_of_light_have_one_position() {
    scene();
    let work = SampleWork { sampling: "conventional:4".to_owned(), ..sample_work(sample_cameras()[0].into()) };
    let error = engine().sample(&work, TURN).expect_err("refused").to_string();
    assert!(error.contains("sampling_method") && error.contains("samples of light have one"), "{error}");
}

#[test]
fn a_layered_cube_is_no_cache_of_light_yet() {
    let grid = CubeGrid::around(&scene().bounds(), 16).expect("a grid");
    let work = SampleWork {
        cameras: grid.cameras().map(SampleCamera::from).to_vec(),
        tile_count: 1,
        wanted: vec![0, 1, 2],
        sampling: "layered_cube:16".to_owned(),
        planes: engine().sample_planes(METHOD).expect("planes"),
        ..sample_work(sample_cameras()[0].into())
    };
    let error = engine().sample(&work, TURN).expect_err("refused").to_string();
    assert!(error.contains("not from a layered cube"), "{error}");
}
