//! The filter of mirrored rays, beside its twin.

use depth_image::{Camera, DepthImage, Environment, Highlight, Illumination, ProvenanceKind, Ray};
use fixtures::teapot_mirror;
use glam::{UVec2, Vec2, Vec3};
use gpu::Turn;
use reconstruction::scalar::ColorMips;
use reconstruction::{RayEnd, RayWork, SetDescription};
use render::{GpuScene, SamplePlanes};

use crate::stage::{gpu, looking, reconstructor, renderer, work};

/// Beside the mirror, which has no light to show: only sets in which something reflects have filtered colours.
const EYE: Vec3 = Vec3::new(6.0, 3.1, -4.5);
const TOWARDS: Vec3 = Vec3::new(-0.9, -0.3, 1.0);
const NEAR_M: f32 = 1e-3;
/// Footprints: far less than a texel where rays end, several, and more than the image has.
const WIDTHS_M: [f32; 5] = [0.01, 0.2, 0.5, 1.7, 60.0];
/// Colours are 9 bits.
const ROUNDING: f32 = 0.01;

/// From places beside the image's eye towards the floor and the teapot.
fn rays() -> Vec<Ray> {
    let spread = |number: usize, step: f64| (0.5 + step * number as f64).fract() as f32 - 0.5;
    let ray = |number| {
        let [x, y] = [0.754_877_7, 0.569_840_3].map(|step| spread(number, step));
        let [u, v] = [0.819_172_5, 0.671_043_6].map(|step| spread(number, step));
        let origin_in_world = EYE + Vec3::new(x, y, 0.0);
        Ray { origin_in_world, direction_in_world: (TOWARDS + Vec3::new(1.2 * u, v, -1.2 * u)).normalize_or(Vec3::Z) }
    };
    (0..4000).map(ray).collect()
}

/// The twin's colour at the end of a ray whose colour without width is known.
fn expected(image: &DepthImage, mips: &ColorMips, (ray, end): (&Ray, &RayEnd), width_m: f32) -> Option<Vec3> {
    let pinhole = image.camera.pinhole()?;
    let at = pinhole.project(ray.at(end.way_m))?;
    // Between the corners of the last cell, as `nearest_at.wgsl` has it.
    let most = image.size_px().as_vec2() - 0.51;
    let place_px = at.pixel.clamp(Vec2::splat(0.5), most);
    let side_m = at.planar_depth_m / pinhole.focal_px.min_element();
    Some(mips.filtered(end.color_linear, place_px, width_m / side_m))
}

#[test]
fn wide_rays_have_the_colours_of_their_twin() {
    let scene = teapot_mirror();
    let on_device = GpuScene::upload(gpu(), &scene).expect("a scene");
    let camera = Camera::from(looking(EYE, EYE + TOWARDS, 80.0, UVec2::new(190, 130)));
    let planes = SamplePlanes { specular: true, ..SamplePlanes::default() };
    let images = renderer().draw_depth_images(work(&on_device, "shadows"), &[camera], planes).expect("images");
    let dark = Environment::uniform(Vec3::ZERO);
    let set = reconstructor()
        .upload(
            &images,
            &SetDescription {
                volume: scene.bounds(),
                background: dark,
                illumination: &Illumination { lights: Vec::new(), environment: dark },
                highlight: Some(Highlight::Ggx),
                environment: None,
                mips: true,
            },
            Turn::default(),
        )
        .expect("a set");
    let image = &images[0];
    let mips = ColorMips::of(&images[0]);
    let rays = rays();
    let follow =
        |width_m| reconstructor().follow(RayWork { width_m, ..RayWork::new(&set, NEAR_M) }, &rays).expect("ends").0;
    let narrow = follow(0.0);
    for width_m in WIDTHS_M {
        let mut hits = 0;
        let mut alike = 0;
        let mut changed = 0;
        for ((ray, own), wide) in rays.iter().zip(&narrow).zip(follow(width_m)) {
            assert_eq!((own.kind, own.way_m), (wide.kind, wide.way_m), "a ray ends where it ends without width");
            let Some(color) = expected(image, &mips, (ray, own), width_m) else { continue };
            if own.kind == ProvenanceKind::Hit {
                hits += 1;
                alike += i32::from((color - wide.color_linear).abs().max_element() <= ROUNDING);
                changed += i32::from((own.color_linear - wide.color_linear).abs().max_element() > ROUNDING);
            }
        }
        println!("{width_m} m: {alike} of {hits} alike, {changed} filtered");
        assert!(hits > 2000 && alike as f32 >= 0.999 * hits as f32, "{width_m} m: {alike} of {hits}");
        assert!(if width_m < 0.05 { changed == 0 } else { changed * 20 > hits }, "{width_m} m: {changed} of {hits}");
    }
}
