//! Closed forms: views that are known without any oracle.

use depth_image::{DepthImage, Environment, ProvenanceKind, View, srgb8_from_linear};
use fixtures::{quad, uv_sphere};
use glam::{UVec2, Vec2, Vec3};
use reconstruction::{CodedDepth, ReconstructionMethod};

use crate::stage::{
    CARVE, Corners, SAMPLE_PX, SEARCH, Stage, VIEW_PX, colors_differ_by, count, depths, kinds, looking, psnr_db,
};

const FINE_SEARCH: ReconstructionMethod = ReconstructionMethod::LightFieldSearch { steps: 256 };
const COLOR: [u8; 3] = [200, 120, 60];

/// In front of the origin, facing it.
fn wall(distance_m: f32) -> scene::Scene {
    quad(Vec3::NEG_Z * distance_m, 1.0, Vec3::Z, COLOR)
}

fn looking_ahead(eye: Vec3, size_px: UVec2) -> depth_image::PinholeCamera {
    looking(eye, eye + Vec3::NEG_Z, 45.0, size_px)
}

/// Half a code, in inverse metres.
fn half_code(image: &DepthImage) -> f32 {
    0.5 / CodedDepth::of(image).scale
}

#[test]
fn a_wall_four_metres_ahead_reads_four_metres() {
    let eyes = [Vec3::new(-0.3, 0.2, 0.0), Vec3::new(0.3, -0.2, 0.0)];
    let stage = Stage::new(wall(4.0), &eyes.map(|eye| looking_ahead(eye, SAMPLE_PX)));
    let view = stage.view(&looking_ahead(Vec3::ZERO, VIEW_PX), CARVE);
    let slack = stage.images.iter().map(half_code).fold(0.0, f32::max) + 1e-4;
    let hits: Vec<usize> = (0..kinds(&view).len()).filter(|&i| kinds(&view)[i] == ProvenanceKind::Hit).collect();
    assert!(hits.len() > 500, "{} pixels are covered", hits.len());
    let errors = hits.iter().map(|&i| (depths(&view)[i] - 0.25).abs());
    let worst = errors.fold(0.0, f32::max);
    println!("{} pixels, off by at most {worst:.2e} per metre, {slack:.2e} allowed", hits.len());
    assert!(worst <= slack, "{worst}");
}

#[test]
fn one_color_stays_that_color() {
    for method in [CARVE, SEARCH] {
        let eyes = [Vec3::new(-0.3, 0.2, 0.0), Vec3::new(0.3, -0.2, 0.0), Vec3::new(0.3, 0.2, 0.1)];
        let mut stage = Stage::new(wall(4.0), &eyes.map(|eye| looking_ahead(eye, SAMPLE_PX)));
        // Everything has the wall's colour, so that blending has nothing else to blend.
        let linear = Vec3::from(COLOR.map(depth_image::linear_from_srgb8));
        stage.images.iter_mut().for_each(|i| i.color_rgb9e5.fill(depth_image::rgb9e5_from_linear(linear)));
        let view = stage.view(&looking_ahead(Vec3::ZERO, VIEW_PX), method);
        let hit: Vec<_> = (0..kinds(&view).len()).filter(|&i| kinds(&view)[i] == ProvenanceKind::Hit).collect();
        assert!(hit.len() > 500, "{method}: {}", hit.len());
        let worst = hit.iter().flat_map(|&i| (0..3).map(move |c| (i, c)));
        let worst = worst.map(|(i, c)| view.srgb8[3 * i + c].abs_diff(COLOR[c])).max();
        assert!(worst <= Some(1), "{method}: off by {worst:?} codes");
    }
}

#[test]
fn a_samples_own_pose_shows_the_sample() {
    for (name, scene, corners) in crate::stage::corpus() {
        let samples = corners.samples(4);
        let stage = Stage::new(scene, &samples);
        let view = stage.view(&samples[1], CARVE);
        let truth = stage.drawn_directly(&samples[1]);
        let inside = inside(&truth);
        let psnr = psnr_db(&truth, &view, &inside);
        let share = inside.iter().filter(|&&i| i).count() as f64 / inside.len() as f64;
        println!("{name}: {psnr:.1} dB away from silhouettes, {:.0} % of the pixels", share * 100.0);
        assert!(share > 0.3 && psnr > 35.0, "{name}: {psnr:.1} dB, {share}");
    }
}

/// A plane seen at a steep slant has great jumps between neighbours, and is still one surface.
#[test]
fn a_grazing_plane_stays_in_one_piece() {
    for degrees in [60.0f32, 80.0, 85.0] {
        let elevation = (90.0 - degrees).to_radians();
        let eye = |azimuth: f32| {
            Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos()) * 4.0
        };
        let camera = |azimuth, size_px| looking(eye(azimuth), Vec3::ZERO, 40.0, size_px);
        // They see more around, so that the whole view is theirs.
        let wide = |azimuth| looking(eye(azimuth), Vec3::ZERO, 60.0, SAMPLE_PX);
        let stage = Stage::new(quad(Vec3::ZERO, 2.0, Vec3::Y, COLOR), &[wide(-0.1), wide(0.1)]);
        let view = stage.view(&camera(0.03, VIEW_PX), CARVE);
        let truth = stage.drawn_directly(&camera(0.03, VIEW_PX));
        let both = kinds(&truth).into_iter().zip(kinds(&view)).filter(|(t, _)| *t == ProvenanceKind::Hit);
        let (covered, found) = both.fold((0, 0), |(c, f), (_, v)| (c + 1, f + usize::from(v == ProvenanceKind::Hit)));
        println!("{degrees}°: {found} of {covered} pixels");
        // The outline may differ by a pixel all around; the inside has no gap.
        assert!(covered > 40 && holes_inside(&truth, &view) == 0, "{degrees}°: {}", holes_inside(&truth, &view));
    }
}

/// Pixels that are one surface with their neighbours, or all background.
fn inside(truth: &View) -> Vec<bool> {
    let width = truth.size_px.x as usize;
    let height = truth.size_px.y as usize;
    let is_inside = |i: usize| {
        let x = i % width;
        let y = i / width;
        let on_border = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
        let around = || (0..9).map(|k| depths(truth)[i + (k / 3) * width + k % 3 - width - 1]);
        !on_border && around().fold(f32::MAX, f32::min) >= 0.9 * around().fold(0.0, f32::max)
    };
    (0..width * height).map(is_inside).collect()
}

/// Pixels of the inside of surfaces that are no hit.
fn holes_inside(truth: &View, view: &View) -> usize {
    let covered = inside(truth).into_iter().zip(kinds(truth)).map(|(inside, k)| inside && k == ProvenanceKind::Hit);
    covered.zip(kinds(view)).filter(|(covered, k)| *covered && *k != ProvenanceKind::Hit).count()
}

#[test]
fn the_order_of_the_samples_is_no_matter() {
    let corners = Corners { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.6 };
    let stage = Stage::new(uv_sphere(1.0, 32), &corners.samples(4));
    for method in [CARVE, SEARCH] {
        let view = stage.view(&corners.view(), method);
        let mut other = stage.clone();
        other.images.rotate_left(1);
        other.images.swap(0, 2);
        let permuted = other.view(&corners.view(), method);
        let pixels = kinds(&view).len();
        let same = (0..pixels).filter(|&i| colors_differ_by(&view, &permuted, i) <= 1).count();
        assert!(same as f64 / pixels as f64 >= 0.999, "{method}: {same} of {pixels}");
        assert!(count(&view, ProvenanceKind::Hit) > 300, "{method}");
    }
}

#[test]
fn a_search_in_small_steps_finds_the_wall_too() {
    let stage = Stage::new(wall(4.0), &[looking_ahead(Vec3::X * 0.2, SAMPLE_PX)]);
    let view = stage.view(&looking_ahead(Vec3::ZERO, VIEW_PX), FINE_SEARCH);
    let kinds = kinds(&view);
    let near =
        |(kind, inverse): &(&ProvenanceKind, &f32)| **kind == ProvenanceKind::Hit && (*inverse - 0.25).abs() < 1e-3;
    let found = kinds.iter().zip(depths(&view)).filter(near);
    assert!(found.count() > 500);
}

/// A wall before a gradient: pixels without a surface show it in their own direction, drawn and reconstructed alike.
#[test]
fn a_background_by_direction_is_the_same_drawn_and_reconstructed() {
    let background = Environment::gradient(Vec3::new(0.9, 0.7, 0.5), Vec3::new(0.0, 0.1, 0.3));
    let eyes = [Vec3::new(-0.3, 0.2, 0.0), Vec3::new(0.3, -0.2, 0.0)];
    let scene = scene::Scene { background, ..wall(4.0) };
    let stage = Stage::with_corners(scene, &eyes.map(|eye| looking_ahead(eye, SAMPLE_PX)));
    let camera = looking(Vec3::ZERO, Vec3::new(0.1, 0.2, -1.0), 60.0, VIEW_PX);
    let drawn = stage.drawn_directly(&camera);
    let expected = |index: usize| {
        let x = index as u32 % VIEW_PX.x;
        let y = index as u32 / VIEW_PX.x;
        let ray = camera.ray(Vec2::new(x as f32, y as f32) + 0.5);
        background.radiance_linear(ray.direction_in_world.normalize_or_zero()).to_array().map(srgb8_from_linear)
    };
    let is_empty = |view: &View, index: usize| kinds(view)[index] == ProvenanceKind::Empty;
    for method in [CARVE, SEARCH, ReconstructionMethod::Mesh, ReconstructionMethod::HybridMesh { merged: None }] {
        for (name, view) in [("device", stage.view(&camera, method)), ("twin", stage.twin(&camera, method))] {
            let both: Vec<usize> =
                (0..drawn.srgb8.len() / 3).filter(|&i| is_empty(&drawn, i) && is_empty(&view, i)).collect();
            assert!(both.len() > 500, "{method}, {name}: {} pixels", both.len());
            for &index in &both {
                let differ = (0..3).map(|c| view.srgb8[3 * index + c].abs_diff(expected(index)[c])).max();
                assert!(differ <= Some(1), "{method}, {name}, pixel {index}: {differ:?}");
                assert!(colors_differ_by(&drawn, &view, index) <= 1, "{method}, {name}, pixel {index}");
            }
            let colors: std::collections::BTreeSet<u8> = both.iter().map(|&index| view.srgb8[3 * index]).collect();
            assert!(colors.len() > 20, "{method}, {name}: no gradient, {colors:?}");
        }
    }
}
