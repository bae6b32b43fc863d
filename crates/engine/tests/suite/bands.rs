//! Views with more pixels than a device's buffers hold are made in bands, and are what they would be in one piece.

use cluster::DIRECT;
use depth_image::{Antialias, PinholeCamera, VIEW_REACH_PX, View, ViewPart, ViewPlanes};
use fixtures::uv_sphere;
use glam::{UVec2, Vec2, Vec3};
use node::{DirectWork, Engine, SampleSet, Turn, ViewWork, WorkClass};
use scene::Scene;

use crate::stage::{engine, light_set, sample_set};

const LIGHTING: &str = "soft 2";
const HASH: &str = "a ball";
const TURN: Turn = Turn { class: WorkClass::Batch, flow: Turn::COMMON_FLOW };
/// More than a band, of which each has two million pixels.
const SIZE_PX: UVec2 = UVec2::new(512, 4608);
/// Rows on both sides of where a band ends.
const CROP: [u32; 2] = [3840, 4240];

fn camera(x: f32, size_px: UVec2) -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(x, 0.4, 2.6), Vec3::ZERO, Vec3::Y, 0.9, size_px)
}

/// Pixels are so narrow that the whole ball is seen.
fn view_camera() -> PinholeCamera {
    let camera = camera(0.05, SIZE_PX);
    PinholeCamera { focal_px: Vec2::new(camera.focal_px.x / 6.0, camera.focal_px.y), ..camera }
}

/// The same rows, seen by a camera of their own.
fn crop_camera() -> PinholeCamera {
    let size_px = UVec2::new(SIZE_PX.x, CROP[1] - CROP[0]);
    view_camera().part(&ViewPart { first_px: UVec2::new(0, CROP[0]), size_px })
}

fn samples(scene: &Scene) -> SampleSet {
    let cameras = [-0.5, 0.5].map(|x| camera(x, UVec2::new(320, 240)));
    sample_set((HASH, scene), &cameras, LIGHTING)
}

/// The share of the crop's bytes that differ by more than rounding, and how many pixels show the ball. What is beyond the
/// crop's border is unknown to it: rows near it do not count.
fn differences(whole: &View, crop: &View) -> (f64, usize) {
    let row = SIZE_PX.x as usize;
    let counted = VIEW_REACH_PX as usize * row..((CROP[1] - CROP[0] - VIEW_REACH_PX) as usize) * row;
    let first = CROP[0] as usize * row;
    let expected = &whole.srgb8[3 * (first + counted.start)..3 * (first + counted.end)];
    let bytes = &crop.srgb8[3 * counted.start..3 * counted.end];
    let differ = expected.iter().zip(bytes).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    let depths = crop.inverse_depth_per_m.as_ref().expect("depth");
    (differ as f64 / bytes.len() as f64, depths.iter().filter(|depth| **depth > 0.0).count())
}

#[test]
fn a_view_in_bands_is_its_crops() {
    let scene = uv_sphere(1.0, 96);
    engine().put_scene(HASH, &scene).expect("a scene");
    let set = engine().upload(&samples(&scene), TURN).expect("a set");
    let cameras = [-0.5, 0.5].map(|x| camera(x, UVec2::new(320, 240)));
    let light = engine().upload(&light_set((HASH, &scene), &cameras, LIGHTING), TURN).expect("a set");
    let planes = ViewPlanes { antialias: Antialias::of(2).expect("offered"), ..ViewPlanes::ALL };
    for method in ["joint_carve", "light_cache", DIRECT] {
        let views = [view_camera(), crop_camera()].map(|camera| {
            let cameras = vec![camera];
            let scene_hash = HASH.to_owned();
            let lighting = LIGHTING.to_owned();
            let method = method.to_owned();
            let views = if method == DIRECT {
                let work =
                    DirectWork { scene_hash, cameras, lighting, scene_time_s: 0.0, planes, surfaces_by_rays: None };
                engine().draw_direct(&work, TURN)
            } else {
                let set = if method == "light_cache" { &light } else { &set };
                engine().reconstruct(set.as_ref(), &ViewWork { cameras, method, planes }, TURN)
            };
            views.expect("a view").remove(0)
        });
        let [whole, crop] = &views;
        assert_eq!(whole.size_px, SIZE_PX);
        assert_eq!(whole.srgb8.len(), 3 * view_camera().pixel_count());
        let (differ, shown) = differences(whole, crop);
        println!("{method}: {differ} of the bytes differ, {shown} pixels show the ball");
        assert!(shown > 10_000 && differ < 1e-3, "{method}: {differ}, {shown}");
    }
}
