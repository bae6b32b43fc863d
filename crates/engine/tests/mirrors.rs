//! Views of sets with mirror cells show the scene in mirrors, about as views that are drawn directly do.

mod common;

use std::sync::Arc;

use depth_image::{Camera, PinholeCamera, ProvenanceKind, View, ViewPlanes};
use engine::GpuEngine;
use glam::{UVec2, Vec3};
use gpu::DevicePreference;
use node::{DirectWork, Engine, MirrorSet, SampleSet, SharedSet, Turn, UploadedSet, ViewWork, WorkClass};
use sampling::Impostors;
use scene::{Limits, MissingTextures, Scene, SceneSpec};

const LIGHTING: &str = "shadows, reflections 1";
const HASH: &str = "a teapot before a mirror";
const TURN: Turn = Turn { class: WorkClass::Batch, flow: Turn::COMMON_FLOW };

/// A scene on the software device, and what its views are made from.
struct Stand {
    engine: GpuEngine,
    scene: Scene,
}

impl Stand {
    fn new() -> Self {
        let spec: SceneSpec = "teapot-mirror".parse().expect("a name");
        let scene = spec.load(&Limits::default(), MissingTextures::Refuse).expect("a scene");
        let engine = GpuEngine::open(DevicePreference::Software).expect("an engine");
        engine.put_scene(HASH, &scene).expect("a scene");
        Self { engine, scene }
    }

    fn set(&self, cameras: &[impl Copy + Into<Camera>], is_mirror: bool) -> SharedSet {
        let set = common::sample_set(&self.engine, (HASH, &self.scene), cameras, LIGHTING);
        self.engine.upload(&SampleSet { is_mirror, ..set }, TURN).expect("a set")
    }

    fn mirrors(&self, impostors: Impostors) -> Vec<MirrorSet> {
        let (mirrors, beyond) = sampling::mirrors(&self.scene, impostors);
        assert_eq!((mirrors.len(), beyond), (1, 0));
        mirrors.into_iter().map(|mirror| (mirror.bounds, self.set(&mirror.cameras, true))).collect()
    }

    fn view(&self, set: &dyn UploadedSet) -> View {
        let method = "joint_carve".to_owned();
        let work = ViewWork { cameras: vec![camera()], method, planes: ViewPlanes::ALL };
        self.engine.reconstruct(set, &work, TURN).expect("a view").remove(0)
    }

    fn direct(&self, lighting: &str) -> View {
        let work = DirectWork {
            scene_hash: HASH.to_owned(),
            cameras: vec![camera()],
            lighting: lighting.to_owned(),
            scene_time_s: 0.0,
            planes: ViewPlanes::COLOR,
        };
        self.engine.draw_direct(&work, TURN).expect("a view").remove(0)
    }
}

/// From behind the teapot, onto the mirror.
fn camera() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(9.0, 6.0, 9.0), Vec3::new(0.0, 2.5, -2.0), Vec3::Y, 0.6, UVec2::new(96, 72))
}

/// The mean difference over pixels, in codes.
fn difference(a: &View, b: &View, of: &[bool]) -> f64 {
    let pixels = a.srgb8.chunks_exact(3).zip(b.srgb8.chunks_exact(3)).zip(of).filter(|(_, of)| **of);
    let (mut sum, mut count) = (0u32, 0u32);
    for ((a, b), _) in pixels {
        sum += a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum::<u32>();
        count += 3;
    }
    f64::from(sum) / f64::from(count)
}

#[test]
fn views_of_sets_with_mirror_cells_show_the_scene_in_mirrors() {
    let stand = Stand::new();
    let truth = stand.direct(LIGHTING);
    let plain = stand.direct("shadows");
    let differs = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 8);
    let mirrored: Vec<bool> = truth.srgb8.chunks_exact(3).zip(plain.srgb8.chunks_exact(3)).map(differs).collect();
    assert!(mirrored.iter().filter(|is| **is).count() > 500, "the mirror is seen");
    // The view's own image: its errors are those of the mirror.
    let set = stand.set(&[camera()], false);
    let without = stand.view(set.as_ref());
    let with =
        stand.view(stand.engine.mirroring(set.clone(), stand.mirrors(Impostors::default())).expect("a set").as_ref());
    let [before, after] = [&without, &with].map(|view| difference(view, &truth, &mirrored));
    println!("mean difference in mirrors: {before:.1} codes without mirror cells, {after:.1} with");
    assert!(after < 0.6 * before, "{before} {after}");
    let others: Vec<bool> = mirrored.iter().map(|is| !is).collect();
    assert!(difference(&with, &without, &others) < 1.0, "other pixels stay");
    let kinds = with.provenance.as_ref().expect("provenance").iter().map(|provenance| provenance.kind());
    let guessed = kinds.zip(&mirrored).filter(|(kind, is)| **is && *kind == ProvenanceKind::Guessed).count();
    assert!(guessed * 50 < mirrored.iter().filter(|is| **is).count(), "{guessed} guessed");
    let again = stand.view(stand.engine.mirroring(set, stand.mirrors(Impostors::default())).expect("a set").as_ref());
    assert_eq!(with.srgb8, again.srgb8);
}

/// Single-pole images show the teapot; the rest of the mirror stays.
#[test]
fn single_pole_images_show_the_object_in_mirrors() {
    let stand = Stand::new();
    let truth = stand.direct(LIGHTING);
    let set = stand.set(&[camera()], false);
    let without = stand.view(set.as_ref());
    let mirrors = stand.mirrors(Impostors::SinglePoles { images: 2 });
    let with = stand.view(stand.engine.mirroring(set.clone(), mirrors).expect("a set").as_ref());
    let differs = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 8);
    let found: Vec<bool> = with.srgb8.chunks_exact(3).zip(without.srgb8.chunks_exact(3)).map(differs).collect();
    let [before, after] = [&without, &with].map(|view| difference(view, &truth, &found));
    let count = found.iter().filter(|is| **is).count();
    println!("{count} pixels: mean difference {before:.1} codes without mirror cells, {after:.1} with");
    assert!(count > 40 && after < 0.7 * before, "{count}: {before} {after}");
    let refused = stand.engine.reconstruct(
        stand.mirrors(Impostors::SinglePoles { images: 1 })[0].1.as_ref(),
        &ViewWork { cameras: vec![camera()], method: "joint_carve".to_owned(), planes: ViewPlanes::COLOR },
        TURN,
    );
    assert!(refused.is_err_and(|error| error.to_string().contains("single_pole")), "views are made from pinholes");
}

#[test]
fn sets_of_other_devices_are_refused_as_mirrors() {
    let stand = Stand::new();
    let set = stand.set(&[camera()], false);
    struct Foreign;
    impl UploadedSet for Foreign {}
    let bounds = stand.scene.bounds();
    let refused = stand.engine.mirroring(set.clone(), vec![(bounds, Arc::new(Foreign))]).err().map(|e| e.to_string());
    assert_eq!(refused.as_deref(), Some("device: a sample set of another device"));
    assert!(stand.engine.mirroring(Arc::new(Foreign), Vec::new()).is_err());
    let too_many = stand.engine.mirroring(set.clone(), vec![(bounds, set); 9]).expect("a set");
    let work = ViewWork { cameras: vec![camera()], method: "joint_carve".to_owned(), planes: ViewPlanes::COLOR };
    let refused = stand.engine.reconstruct(too_many.as_ref(), &work, TURN).err().map(|error| error.to_string());
    assert_eq!(refused.as_deref(), Some("mirror_cells: views have at most 8 mirror cells, not 9"));
}

/// Light that depends on the viewer is no part of samples.
#[test]
fn samples_are_those_of_lighting_without_glossy_reflections() {
    let stand = Stand::new();
    let [glossy, plain] = ["shadows, glossy 4", "shadows"]
        .map(|lighting| common::sample_set(&stand.engine, (HASH, &stand.scene), &[camera()], lighting).images);
    assert!(glossy == plain);
}
