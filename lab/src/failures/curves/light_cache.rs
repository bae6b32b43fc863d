//! Light of samples at surfaces of the scene: edges of light within a texel, and the points that no sample knows.

use depth_image::LightCacheQuality::{Balanced, Fast, Fine};
use depth_image::{Environment, Illumination, PinholeCamera, View, nested_places};
use glam::{UVec2, Vec2, Vec3};
use scene::procedural::courtyard;

use crate::failures::cached_light::{
    ComparedPixels, Cuboid, LitScene, floor_with, mean_light, pixels_where, sun, unknown_share,
};
use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::shape::Shape;
use crate::failures::stage::YARD;
use crate::failures::stand::Stand;

const FLOOR_HALF_M: f32 = 2.5;
const EYE_HEIGHT_M: f32 = 4.0;
const FOV_DEG: f32 = 45.0;
/// Half the distance between the sample cameras over the floor.
const CAMERAS_HALF_M: f32 = 0.3;
/// A view between the sample cameras, as a share of that distance.
const VIEW_PLACE: Vec2 = Vec2::new(0.23, -0.31);
/// The height of bars, and the distance of their shadows.
const BARS_HEIGHT_M: f32 = 0.25;
const BARS_APART_M: f32 = 0.5;
const BARS_HALF_LENGTH_M: f32 = 1.0;
const DENSITIES: X = X::log("density of samples", "texels a pixel", &[0.125, 0.25, 0.5, 1.0]);
const ERROR: [&str; 2] = ["mean difference of colours near by", "of 255"];

pub const CURVES: [Curve; 4] = [
    Curve {
        name: "Light that leaks at the foot of a wall",
        subject: "a wall of 0.3 pixels between a lit and a dark floor, from above, two images",
        x: DENSITIES,
        y: ERROR,
        series: &[
            Series::new("fast", &[Shape::falls(10.0, 0.2)]),
            Series::new("balanced", &[Shape::Bounded { least: 0.0, most: 0.5 }]),
        ],
        why: "A texel on the lit side and one on the dark side surround points of both. They disagree, which balanced notices.",
        measure: at_a_wall,
    },
    Curve {
        name: "Contrast of narrow shadows",
        subject: "bars over a floor, two images of half the view's density",
        x: X::log("width of the bars", "texels", &[0.125, 0.25, 0.5, 1.0, 2.0, 4.0]),
        y: ["contrast of the shadows", ""],
        series: &[
            Series::new("fast", &[Shape::rises(0.4, 0.02)]),
            Series::new("balanced", &[Shape::rises(0.2, 0.02)]),
            Series::new("direct", &[Shape::Bounded { least: 0.99, most: 1.0 }]),
        ],
        why: "A shadow narrower than a texel is in few of the texels. Where it is in none of the four around a point, nothing tells of it.",
        measure: under_bars,
    },
    Curve {
        name: "Contact shadow against the density of samples",
        subject: "cubes of three pixels on a floor under an open sky, two images",
        x: DENSITIES,
        y: ERROR,
        series: &[
            Series::new("fast", &[Shape::falls(5.0, 0.2)]),
            Series::new("balanced", &[Shape::falls(5.0, 0.2)]),
            Series::new("fine", &[Shape::falls(1.0, 0.2)]),
        ],
        why: "The shadow is soft: neighbouring texels differ by less than half, so balanced trusts what coarse texels leave of it. Fine notices more.",
        measure: around_cubes,
    },
    Curve {
        name: "Light unknown against the number of images",
        subject: "a courtyard under a sun, images of the view's density",
        x: X::log("images", "", &[1.0, 2.0, 4.0]),
        y: ["surfaces whose light no sample knows", ""],
        series: &[Series::new("balanced", &[Shape::falls(0.01, 0.002)])],
        why: "Each further image surrounds points that others see at an edge, or not at all.",
        measure: by_images,
    },
];

/// A camera over the floor. Its rows are not along the axes, so that edges cross texels at every place.
fn over_the_floor(place: Vec2, size_px: UVec2) -> PinholeCamera {
    let eye = Vec3::new(place.x * CAMERAS_HALF_M, EYE_HEIGHT_M, place.y * CAMERAS_HALF_M);
    PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::new(0.4, 0.0, -1.0), FOV_DEG.to_radians(), size_px)
}

fn two_over_the_floor(size_px: UVec2) -> Vec<PinholeCamera> {
    nested_places(2).iter().map(|&place| over_the_floor(place, size_px)).collect()
}

/// The size of views. Those of tests are twice as large as for other curves: an eighth of their density still has texels.
fn large_view_px(stand: &Stand) -> UVec2 {
    if stand.is_small { 2 * stand.view_px } else { stand.view_px }
}

fn at_density(size_px: UVec2, density: f64) -> UVec2 {
    (size_px.as_dvec2() * density).round().as_uvec2()
}

/// A pixel's side on the floor.
fn footprint_m(camera: &PinholeCamera) -> f32 {
    EYE_HEIGHT_M / camera.focal_px.y
}

fn at_a_wall(stand: &Stand, densities: &[f64]) -> anyhow::Result<Rows> {
    let camera = over_the_floor(VIEW_PLACE, large_view_px(stand));
    let pixel_m = footprint_m(&camera);
    let wall = Cuboid { center: Vec3::Y * 0.3, size_m: Vec3::new(0.3 * pixel_m, 0.6, 3.0) };
    let lit = LitScene::new(stand, &floor_with(&[wall], FLOOR_HALF_M, sun(Vec3::new(1.0, 1.0, 0.0))), "shadows")?;
    let truth = lit.direct(camera)?;
    let near = pixels_where(&camera, &truth, |p| p.y.abs() < 1e-3 && p.x.abs() < 6.0 * pixel_m && p.z.abs() < 1.0);
    let compared = ComparedPixels { camera, truth, pixels: near };
    rows(densities, |density| {
        let images = lit.samples(&two_over_the_floor(at_density(camera.size_px, density)))?;
        Ok([compared.error(&lit, &images, Fast)?, compared.error(&lit, &images, Balanced)?])
    })
}

fn under_bars(stand: &Stand, widths: &[f64]) -> anyhow::Result<Rows> {
    let camera = over_the_floor(VIEW_PLACE, large_view_px(stand));
    let sample_cameras = two_over_the_floor(at_density(camera.size_px, 0.5));
    let texel_m = footprint_m(&sample_cameras[0]);
    rows(widths, |width| {
        let width_m = width as f32 * texel_m;
        let bars = [-1.0, 0.0, 1.0].map(|number| Cuboid {
            center: Vec3::new(number * BARS_APART_M, BARS_HEIGHT_M, 0.0),
            size_m: Vec3::new(width_m, 1e-4, 2.0 * BARS_HALF_LENGTH_M),
        });
        let scene = floor_with(&bars, FLOOR_HALF_M, sun(Vec3::new(1.0, 1.0, 0.0)));
        let lit = LitScene::new(stand, &scene, "shadows")?;
        let images = lit.samples(&sample_cameras)?;
        let fast = lit.cached(&images, Fast, camera)?;
        let balanced = lit.cached(&images, Balanced, camera)?;
        Ok([fast, balanced, lit.direct(camera)?].map(|view| shadow_contrast(&camera, &view, width_m)))
    })
}

/// How much darker the shadows of bars are than the floor beside the bars.
fn shadow_contrast(camera: &PinholeCamera, view: &View, width_m: f32) -> f64 {
    let dark = pixels_where(camera, view, |p| {
        let across = p.x + BARS_HEIGHT_M;
        let from_shadow_m = (across - (across / BARS_APART_M).round().clamp(-1.0, 1.0) * BARS_APART_M).abs();
        p.y.abs() < 1e-3 && p.z.abs() < BARS_HALF_LENGTH_M - 0.1 && from_shadow_m < 0.4 * width_m
    });
    let bright = pixels_where(camera, view, |p| p.y.abs() < 1e-3 && p.x.abs() > 1.2);
    1.0 - mean_light(view, &dark) / mean_light(view, &bright)
}

fn around_cubes(stand: &Stand, densities: &[f64]) -> anyhow::Result<Rows> {
    let camera = over_the_floor(VIEW_PLACE, large_view_px(stand));
    let side_m = 3.0 * footprint_m(&camera);
    let places: Vec<Vec2> =
        (0..25).map(|number| Vec2::new((number % 5) as f32 - 2.0, (number / 5) as f32 - 2.0) * 0.5).collect();
    let cubes: Vec<Cuboid> = places
        .iter()
        .map(|place| Cuboid { center: Vec3::new(place.x, 0.5 * side_m, place.y), size_m: Vec3::splat(side_m) })
        .collect();
    let sky = Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::splat(0.8)) };
    let scene = floor_with(&cubes, FLOOR_HALF_M, sky);
    let truth = LitScene::new(stand, &scene, "shadows, occlusion 256 1m")?.direct(camera)?;
    let lit = LitScene::new(stand, &scene, "shadows, occlusion 64 1m")?;
    let near = pixels_where(&camera, &truth, |p| {
        let from_cube = places.iter().map(|place| (Vec2::new(p.x, p.z) - place).abs().max_element());
        p.y.abs() < 1e-3 && from_cube.fold(f32::INFINITY, f32::min) < side_m
    });
    let compared = ComparedPixels { camera, truth, pixels: near };
    rows(densities, |density| {
        let images = lit.samples(&two_over_the_floor(at_density(camera.size_px, density)))?;
        Ok([
            compared.error(&lit, &images, Fast)?,
            compared.error(&lit, &images, Balanced)?,
            compared.error(&lit, &images, Fine)?,
        ])
    })
}

/// The mean share of views of the courtyard that no sample knows.
fn unknown_in_the_yard(lit: &LitScene<'_>, cameras: &[PinholeCamera], stand: &Stand) -> anyhow::Result<f64> {
    let images = lit.samples(cameras)?;
    let views = YARD.views(large_view_px(stand));
    let shares = views.iter().map(|&camera| anyhow::Ok(unknown_share(&lit.cached(&images, Balanced, camera)?)));
    let sum = shares.sum::<anyhow::Result<f64>>()?;
    Ok(sum / views.len() as f64)
}

fn by_images(stand: &Stand, counts: &[f64]) -> anyhow::Result<Rows> {
    let lit = LitScene::new(stand, &courtyard().with_default_lights(), "shadows")?;
    rows(counts, |count| {
        let cameras = YARD.samples(count as usize, large_view_px(stand));
        Ok([unknown_in_the_yard(&lit, &cameras, stand)?])
    })
}
