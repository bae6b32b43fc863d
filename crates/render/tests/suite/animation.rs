//! Instances that follow nodes and joints: drawn, traced and by their twins, at several moments.

use depth_image::{DepthImage, PinholeCamera};
use fixtures::quad;
use glam::{DAffine3, Quat, UVec2, Vec3, Vec4};
use render::{DrawWork, GpuScene, Visibility, scalar};
use scene::procedural::snake;
use scene::{
    Animation, Channel, Clip, Interpolation, Joint, MovingInstance, Node, NodeTransform, Property, Scene,
    TransformParts,
};

use crate::stage::{SIZE_PX, image, upload, work};

const MOMENTS_S: [f32; 4] = [0.0, 0.41, 1.3, 2.9];

fn camera() -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(0.5, 3.2, 4.4), Vec3::ZERO, Vec3::Y, 0.8, SIZE_PX)
}

fn at(scene: &GpuScene, scene_time_s: f32, visibility: Visibility) -> DepthImage {
    image(DrawWork { scene_time_s, visibility, ..work(scene, "unlit") }, &camera())
}

/// Pixels in which two pictures show other depths or normals.
fn differing(a: &DepthImage, b: &DepthImage) -> usize {
    let far = |i: &usize| {
        let [x, y] = [a, b].map(|image| image.inverse_depth_per_m[*i]);
        let [n, m] =
            [a, b].map(|image| depth_image::unit_from_oct16(image.normal_oct16.as_ref().expect("normals")[*i]));
        (x - y).abs() > 1e-4 * x.abs().max(1e-3) || (x > 0.0 && n.distance(m) > 0.02)
    };
    (0..a.inverse_depth_per_m.len()).filter(far).count()
}

#[test]
fn drawn_and_traced_pictures_agree_with_the_scene_at_that_moment() {
    let scene = snake();
    let moving = upload(&scene);
    let pixels = SIZE_PX.element_product() as usize;
    let mut first: Option<DepthImage> = None;
    for scene_time_s in MOMENTS_S {
        let drawn = at(&moving, scene_time_s, Visibility::Triangles);
        let traced = at(&moving, scene_time_s, Visibility::Rays);
        let still = at(&upload(&scene.frozen_at(scene_time_s)), 0.0, Visibility::Triangles);
        let [of_still, of_rays] = [&still, &traced].map(|other| differing(&drawn, other));
        println!("{scene_time_s} s: {of_still} pixels differ from the still scene, {of_rays} from rays");
        // The same triangles in another order: where they meet, either may be seen. Rays differ along silhouettes.
        assert!(of_still * 500 < pixels && of_rays * 50 < pixels, "{scene_time_s} s: {of_still}, {of_rays}");
        assert!(drawn.inverse_depth_per_m.iter().filter(|d| **d > 0.0).count() * 4 > pixels);
        if let Some(first) = &first {
            let moved = differing(first, &drawn);
            assert!(moved * 50 > pixels, "{scene_time_s} s: the motion is seen: {moved}");
        }
        first.get_or_insert(drawn);
    }
}

#[test]
fn the_twin_and_every_triangle_say_what_rays_meet() {
    let scene = snake();
    let moving = upload(&scene);
    for scene_time_s in MOMENTS_S {
        let traced = at(&moving, scene_time_s, Visibility::Rays);
        let twin = scalar::rays::Scene::of(&moving, scene_time_s).expect("a tree");
        let still = scene.frozen_at(scene_time_s);
        let mut seen = 0;
        let mut wrong = 0;
        for (x, y) in (0..SIZE_PX.y).step_by(6).flat_map(|y| (0..SIZE_PX.x).step_by(6).map(move |x| (x, y))) {
            let ray = scalar::rays::pixel_ray(&camera(), UVec2::new(x, y));
            let hit = twin.closest(&ray, camera().near_m);
            let nearest = scalar::nearest(&still, &ray, camera().near_m);
            let i = (y * SIZE_PX.x + x) as usize;
            let inverse = [hit.map(|hit| hit.t), nearest.map(|hit| hit.t)].map(|t| t.map_or(0.0, |t| 1.0 / t));
            let depths_agree = inverse.iter().all(|d| (d - traced.inverse_depth_per_m[i]).abs() < 1e-4);
            let normals_agree = hit.zip(nearest).is_none_or(|(hit, nearest)| {
                let of_device = depth_image::unit_from_oct16(traced.normal_oct16.as_ref().expect("normals")[i]);
                [twin.normal_in_world(&hit), nearest.normal_in_world].iter().all(|n| n.distance(of_device) < 0.02)
            });
            seen += u32::from(inverse[0] > 0.0);
            wrong += u32::from(!(depths_agree && normals_agree));
        }
        println!("{scene_time_s} s: {seen} hits, {wrong} wrong");
        assert!(seen > 40 && wrong <= 2, "{scene_time_s} s: {seen} hits, {wrong} wrong");
    }
}

/// A wall before the camera that turns and slides in from far outside the picture.
fn sliding_wall() -> Scene {
    let mut scene = quad(Vec3::NEG_Z * 4.0, 1.0, Vec3::Z, [200, 120, 60]);
    let rest = TransformParts { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };
    let slide = Channel {
        node: 1,
        property: Property::Translation,
        interpolation: Interpolation::Linear,
        times_s: vec![0.0, 1.0, 2.0],
        values: vec![Vec4::X * 100.0, Vec4::ZERO, Vec4::X * 100.0],
    };
    let joints = vec![Joint { node: 1, joint_from_mesh: DAffine3::IDENTITY }];
    scene.animation = Some(Animation {
        nodes: vec![
            Node { parent: None, rest: NodeTransform::Fixed(DAffine3::IDENTITY) },
            Node { parent: Some(0), rest: NodeTransform::Parts(rest) },
        ],
        clips: vec![Clip { name: "slide".into(), channels: vec![slide] }],
        playing: Some(0),
        moving: vec![MovingInstance { instance: 0, joints, influences: Vec::new() }],
        ..Animation::default()
    });
    scene
}

#[test]
fn a_rigid_instance_is_seen_where_its_node_is() {
    let scene = sliding_wall();
    scene.validate(&scene::Limits::default()).expect("a valid scene");
    let on_device = upload(&scene);
    let ahead = PinholeCamera::looking_at(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 0.8, SIZE_PX);
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        let covered = |scene_time_s: f32| {
            let seen = image(DrawWork { scene_time_s, visibility, ..work(&on_device, "unlit") }, &ahead);
            seen.inverse_depth_per_m.iter().map(|d| u32::from((d - 0.25).abs() < 1e-4)).sum::<u32>()
        };
        let whole = covered(1.0);
        assert!(whole > 1000, "{whole}");
        assert_eq!([covered(0.0), covered(0.5), covered(3.0)], [0, 0, whole], "{visibility:?}");
        // At half a metre to the right, the wall is still whole in the picture.
        assert!(covered(1.005).abs_diff(whole) < whole / 20, "{visibility:?}");
    }
}

/// 60 frames of 50,000 triangles: the animated model.
#[test]
fn trees_of_a_skinned_model_are_refitted_from_frame_to_frame() {
    let scene = snake();
    let moving = upload(&scene);
    let mut refitted = 0;
    let mut worst = 0.0f32;
    for frame in 0..60u32 {
        let scene_time_s = frame as f32 / 30.0;
        let report = moving.acceleration(scene_time_s).expect("a tree");
        assert_eq!(report.triangles, 50_002);
        refitted += u32::from(report.refitted);
        if frame % 6 == 5 {
            let built = upload(&scene).acceleration(scene_time_s).expect("a tree");
            worst = worst.max(report.cost / built.cost);
        }
    }
    println!("{refitted} of 60 refitted; cost at most {worst} × a new tree's");
    assert!(refitted >= 48, "{refitted}");
    assert!(worst < 1.5, "{worst}");
}
