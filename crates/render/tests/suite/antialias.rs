//! Direct views of several samples a pixel, and depth images of several samples a texel: means in linear light.

use depth_image::{
    Antialias, Camera, DepthImage, Illumination, Light, PinholeCamera, View, ViewPlanes, linear_from_rgb9e5,
    linear_from_srgb8,
};
use fixtures::poles;
use glam::{UVec2, Vec3};
use render::{DrawWork, GpuScene, SamplePlanes, Visibility};

use crate::stage::{device, down_from, floor_under, upload, work};

fn drawn(
    scene: &GpuScene,
    camera: PinholeCamera,
    planes: ViewPlanes,
    (visibility, lighting): (Visibility, &str),
) -> View {
    let work = DrawWork { visibility, ..work(scene, lighting) };
    device().1.draw_views(work, &[camera], planes).expect("a view").remove(0)
}

#[test]
fn a_pixel_is_the_mean_of_its_positions_in_linear_light() {
    let size_px = UVec2::new(64, 48);
    let camera = PinholeCamera::looking_at(Vec3::new(0.3, 0.4, 4.0), Vec3::NEG_Z, Vec3::Y, 0.8, size_px);
    let scene = upload(&poles(0.08));
    let antialias = Antialias::of(4).expect("offered");
    for how in [Visibility::Triangles, Visibility::Rays].map(|visibility| (visibility, "phong")) {
        let smooth = drawn(&scene, camera, ViewPlanes { antialias, ..ViewPlanes::ALL }, how);
        let views: Vec<View> = antialias
            .offsets_px()
            .map(|offset_px| drawn(&scene, camera.with_offset(offset_px), ViewPlanes::COLOR, how))
            .collect();
        for (byte, &shown) in smooth.srgb8.iter().enumerate() {
            let mean = views.iter().map(|view| linear_from_srgb8(view.srgb8[byte])).sum::<f32>() / 4.0;
            assert!((linear_from_srgb8(shown) - mean).abs() < 0.006, "{how:?}, byte {byte}: {shown}, not {mean}");
        }
        let plain = drawn(&scene, camera, ViewPlanes::ALL, how);
        assert_eq!(smooth.inverse_depth_per_m, plain.inverse_depth_per_m, "{how:?}");
        assert_ne!(smooth.srgb8, plain.srgb8, "{how:?}: nothing changes");
        let colors = drawn(&scene, camera, ViewPlanes { antialias, ..ViewPlanes::COLOR }, how);
        assert_eq!(colors.srgb8, smooth.srgb8, "{how:?}: depth changes the colour");
    }
}

fn sampled(scene: &GpuScene, camera: PinholeCamera, antialias: Antialias, visibility: Visibility) -> DepthImage {
    let work = DrawWork { visibility, ..work(scene, "phong") };
    let planes = SamplePlanes { antialias, normal: true, surface_id: true, ..SamplePlanes::default() };
    device().1.draw_depth_images(work, &[Camera::Pinhole(camera)], planes).expect("an image").remove(0)
}

/// The oracle averages images of one sample a texel by their depths.
#[test]
fn a_texel_is_the_mean_of_its_surface() {
    let size_px = UVec2::new(64, 48);
    let camera = PinholeCamera::looking_at(Vec3::new(0.3, 0.4, 4.0), Vec3::NEG_Z, Vec3::Y, 0.8, size_px);
    let scene = upload(&poles(0.08));
    let antialias = Antialias::of(4).expect("offered");
    for visibility in [Visibility::Triangles, Visibility::Rays] {
        let at = |camera| sampled(&scene, camera, Antialias::NONE, visibility);
        let filtered = sampled(&scene, camera, antialias, visibility);
        let center = at(camera);
        let around: Vec<DepthImage> =
            antialias.offsets_px().map(|offset_px| at(camera.with_offset(offset_px))).collect();
        let mut mixed = 0;
        let mut apart = 0;
        for texel in 0..center.color_rgb9e5.len() {
            let depth = center.inverse_depth_per_m[texel];
            let is_same = |image: &&DepthImage| (image.inverse_depth_per_m[texel] - depth).abs() <= 0.005 * depth;
            let same = [&center].into_iter().chain(around.iter().filter(is_same));
            let colors: Vec<Vec3> = same.map(|image| linear_from_rgb9e5(image.color_rgb9e5[texel])).collect();
            let mean = colors.iter().sum::<Vec3>() / colors.len() as f32;
            let shown = linear_from_rgb9e5(filtered.color_rgb9e5[texel]);
            assert!(shown.abs_diff_eq(mean, 0.004), "{visibility:?}, texel {texel}: {shown}, not {mean}");
            mixed += u32::from(shown.distance(linear_from_rgb9e5(center.color_rgb9e5[texel])) > 0.004);
            apart += u32::from(colors.len() < 5);
        }
        assert!(mixed > 50 && apart > 50, "{visibility:?}: {mixed} means, {apart} texels with other surfaces");
        let other_planes = DepthImage { color_rgb9e5: center.color_rgb9e5.clone(), ..filtered };
        assert!(other_planes == center, "{visibility:?}: other planes are the centre's");
    }
}

/// Positions trace other rays: the noise of one ray each falls as with more rays.
#[test]
fn light_of_several_positions_is_less_noisy() {
    let sun = Light::Directional {
        towards_light_in_world: Vec3::Y,
        irradiance_linear: Vec3::splat(0.9),
        angular_radius_rad: 0.5,
    };
    let illumination = Illumination { lights: vec![sun], ..Illumination::default() };
    let scene = upload(&floor_under(&[(Vec3::Y * 0.6, 0.3, Vec3::NEG_Y)], illumination));
    let camera = PinholeCamera { eye_in_world: Vec3::Y * 0.5, ..down_from(0.5) };
    let of = |samples: u32, rays: u32| {
        let planes = ViewPlanes { antialias: Antialias::of(samples).expect("offered"), ..ViewPlanes::COLOR };
        drawn(&scene, camera, planes, (Visibility::Rays, &format!("soft {rays}")))
    };
    let truth = of(16, 64);
    let off = |view: &View| {
        let squares = view.srgb8.iter().zip(&truth.srgb8).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
        (squares.sum::<f64>() / truth.srgb8.len() as f64).sqrt()
    };
    let one = off(&of(1, 1));
    let sixteen = off(&of(16, 1));
    assert!(one > 5.0 && sixteen < 0.4 * one, "one position: {one}, 16: {sixteen}");
}
