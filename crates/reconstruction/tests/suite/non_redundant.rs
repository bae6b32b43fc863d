//! Images without redundant samples: holes, and samples to which no way is proven free.

use depth_image::{
    DepthImage, HOLE_INVERSE_DEPTH, PinholeCamera, ProvenanceKind, View, linear_from_rgb9e5, rgb9e5_from_linear,
};
use fixtures::{poles, quad};
use glam::{UVec2, Vec3};
use metrics::{PixelClass, classify};
use reconstruction::ReconstructionMethod;

use crate::stage::{
    Agreement, CARVE, Corners, SAMPLE_PX, SEARCH, Stage, VIEW_PX, assert_sane, colors_differ_by, corpus, count, depths,
    kinds, looking,
};

const METHODS: [ReconstructionMethod; 2] = [CARVE, SEARCH];

/// Shares of the foreground: not found, and found too far from where it is.
struct Faults {
    missing: f64,
    wrong: f64,
    disoccluded: f64,
}

fn faults(stage: &Stage, camera: &PinholeCamera, method: ReconstructionMethod) -> Faults {
    let view = stage.view(camera, method);
    let truth = stage.drawn_directly(camera);
    assert_sane(&view, &method.to_string());
    let classes = classify(camera, depths(&truth), &stage.images).expect("planes of one size");
    let mut missing = 0;
    let mut wrong = 0;
    let mut covered = 0;
    let mut disoccluded = 0;
    let mut foreground = 0;
    for (i, class) in classes.iter().enumerate() {
        let surface = depths(&truth)[i] > 0.0;
        foreground += usize::from(surface);
        disoccluded += usize::from(*class == PixelClass::Disoccluded);
        if *class != PixelClass::Covered {
            continue;
        }
        covered += 1;
        let hit = kinds(&view)[i] == ProvenanceKind::Hit;
        missing += usize::from(!hit);
        wrong += usize::from(hit && (depths(&view)[i] / depths(&truth)[i] - 1.0).abs() > 0.01);
    }
    let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
    Faults {
        missing: share(missing, covered),
        wrong: share(wrong, covered),
        disoccluded: share(disoccluded, foreground),
    }
}

#[test]
fn more_is_seen_and_what_is_seen_is_as_right() {
    println!("covered pixels missing and wrong, and disocclusion: conventional, then apart");
    for (name, scene, corners) in corpus() {
        let cameras = corners.samples(4);
        let view = corners.camera(0.1, -0.2, VIEW_PX);
        let whole = Stage::new(scene.clone(), &cameras);
        let apart = Stage::apart(scene, &cameras);
        for method in METHODS {
            let [before, after] = [&whole, &apart].map(|stage| faults(stage, &view, method));
            let percent = |f: &Faults| [f.missing, f.wrong, f.disoccluded].map(|share| 100.0 * share);
            println!("{name:<18} {method:<22} {:5.2?} {:5.2?}", percent(&before), percent(&after));
            assert!(after.disoccluded <= before.disoccluded + 0.005, "{name} {method}: more disoccluded");
            if method == CARVE {
                assert!(after.missing <= before.missing + 0.03, "{name}: {} missing", after.missing);
                assert!(after.wrong <= before.wrong + 0.03, "{name}: {} wrong", after.wrong);
            }
        }
    }
}

#[test]
fn the_device_is_its_twin_among_holes() {
    for (name, scene, corners) in corpus() {
        let stage = Stage::apart(scene, &corners.samples(3));
        for method in METHODS {
            let agreement = Agreement::of(&stage.view(&corners.view(), method), &stage.twin(&corners.view(), method));
            println!("{name:<18} {method:<22} {agreement:?}");
            assert!(agreement.is_good(), "{name} {method}: {agreement:?}");
        }
    }
}

/// Two images of a wall, each with every other texel a hole, side by side they have all.
#[test]
fn halves_make_a_closed_wall() {
    let corners = Corners { eye: Vec3::Z * 4.0, target: Vec3::ZERO, half_m: 0.0 };
    let mut stage = Stage::new(quad(Vec3::ZERO, 3.0, Vec3::Z, [120, 160, 90]), &corners.samples(2));
    for (number, image) in stage.images.iter_mut().enumerate() {
        punch(image, |x, y| (x + y) as usize % 2 == number);
    }
    let view = stage.view(&corners.camera(0.0, 0.0, VIEW_PX), CARVE);
    assert_eq!(count(&view, ProvenanceKind::Hit), VIEW_PX.element_product() as usize);
    // A hole certifies nothing and blocks nothing: beside a whole image an empty one changes nothing.
    let whole = Stage::new(quad(Vec3::ZERO, 3.0, Vec3::Z, [120, 160, 90]), &corners.samples(1));
    let mut beside = whole.clone();
    let mut empty = whole.images[0].clone();
    punch(&mut empty, |_, _| true);
    beside.images.push(empty);
    let camera = corners.camera(0.1, 0.1, VIEW_PX);
    for method in METHODS {
        let alone = whole.view(&camera, method);
        let beside = beside.view(&camera, method);
        let far = (0..kinds(&alone).len()).filter(|&i| colors_differ_by(&alone, &beside, i) > 1).count();
        assert!(far == 0 && kinds(&alone) == kinds(&beside), "{method}: {far} pixels differ");
    }
}

fn punch(image: &mut DepthImage, is_hole: impl Fn(u32, u32) -> bool) {
    let width = image.size_px().x;
    for (place, depth) in (0..).zip(&mut image.inverse_depth_per_m) {
        if is_hole(place % width, place / width) {
            *depth = HOLE_INVERSE_DEPTH;
        }
    }
}

#[test]
fn nothing_but_holes_is_an_honest_nothing() {
    let corners = Corners { eye: Vec3::Z * 4.0, target: Vec3::ZERO, half_m: 0.3 };
    let mut stage = Stage::new(quad(Vec3::ZERO, 1.0, Vec3::Z, [9, 9, 9]), &corners.samples(2));
    stage.images.iter_mut().for_each(|image| punch(image, |_, _| true));
    for method in METHODS {
        let view = stage.view(&corners.view(), method);
        assert_sane(&view, "holes");
        assert_eq!(count(&view, ProvenanceKind::Hit), 0, "{method}");
    }
}

/// Samples that the second image holds behind an omitted pole prove nothing of the way there.
#[test]
fn an_omitted_surface_is_not_carved_away() {
    let camera = looking(Vec3::Z * 4.0, Vec3::Z * -2.0, 60.0, SAMPLE_PX);
    // The same camera twice: the second image is what lies behind the first.
    let stage = Stage::apart(poles(0.08), &[camera, camera]);
    assert!(stage.images[1].passed.is_some());
    let mut naive = stage.clone();
    naive.images[1].passed = None;
    let aside = looking(Vec3::new(0.3, 0.0, 4.0), Vec3::Z * -2.0, 40.0, VIEW_PX);
    let kept = |stage: &Stage| {
        let view = stage.view(&aside, CARVE);
        let truth = stage.drawn_directly(&aside);
        // The wall is the farthest.
        let wall = depths(&truth).iter().copied().filter(|&d| d > 0.0).fold(f32::MAX, f32::min);
        let poles: Vec<usize> = (0..depths(&truth).len()).filter(|&i| depths(&truth)[i] > 1.3 * wall).collect();
        let kept = poles.iter().filter(|&&i| (depths(&view)[i] / depths(&truth)[i] - 1.0).abs() < 0.02).count();
        kept as f64 / poles.len().max(1) as f64
    };
    let right = kept(&stage);
    let wrong = kept(&naive);
    println!("poles kept: {right:.3}, {wrong:.3} if left-out surfaces counted as free space");
    assert!(right > 0.8 && wrong < 0.6, "{right} {wrong}");
}

/// A slanting wall of smooth colour, of which two cameras disagree by a factor.
fn painted_wall(disagreement: f32) -> (Stage, Corners) {
    let corners = Corners { eye: Vec3::new(0.5, 0.3, 4.0), target: Vec3::ZERO, half_m: 0.4 };
    let mut wall = Stage::new(quad(Vec3::ZERO, 3.0, Vec3::new(0.3, 0.1, 1.0), [120, 160, 90]), &corners.samples(2));
    for (number, image) in wall.images.iter_mut().enumerate() {
        paint(image, disagreement.powi(number as i32));
    }
    (wall, corners)
}

/// One image has the left half and the other the right half; or one omits every other square, and the other has all.
#[test]
fn no_seam_shows_where_one_image_hands_over_to_the_other() {
    // Narrower than the samples, that all of it is seen by both.
    let camera = |corners: &Corners| looking(corners.eye, corners.target, 32.0, UVec2::new(128, 96));
    let (whole, corners) = painted_wall(1.02);
    let before = greatest_step(&whole.view(&camera(&corners), CARVE));
    for (name, split) in handing_over(&whole) {
        let after = closed_step(&split, &camera(&corners));
        println!("greatest step between neighbours: {before} codes whole, {after} as {name}");
        assert!(after <= before + 2, "{name}: {before} {after}");
    }
}

/// Two cameras disagree by a fifth, some fourteen codes. A texel of theirs is twenty pixels, over which one fades.
#[test]
fn weight_fades_over_a_cell() {
    let (whole, corners) = painted_wall(1.2);
    let camera = looking(corners.eye, corners.target, 4.0, UVec2::new(160, 120));
    for (name, split) in handing_over(&whole) {
        let view = split.view(&camera, CARVE);
        let (least, most) = view.srgb8.iter().fold((255, 0), |(a, b), &c| (c.min(a), c.max(b)));
        let step = closed_step(&split, &camera);
        println!("greatest step between neighbours where images differ: {step} of {} codes as {name}", most - least);
        assert!(most - least >= 6, "{name}: no image hands over");
        assert!(step <= 2, "{name}: {step}");
    }
}

fn handing_over(whole: &Stage) -> [(&'static str, Stage); 2] {
    let mut halves = whole.clone();
    punch(&mut halves.images[0], |x, _| x > SAMPLE_PX.x / 2);
    punch(&mut halves.images[1], |x, _| x + 24 < SAMPLE_PX.x / 2);
    let mut checker = whole.clone();
    punch(&mut checker.images[1], |x, y| (x / 8 + y / 8) % 2 == 0);
    [("halves", halves), ("checker", checker)]
}

/// A view without gaps.
fn closed_step(stage: &Stage, camera: &PinholeCamera) -> u8 {
    let view = stage.view(camera, CARVE);
    assert_eq!(count(&view, ProvenanceKind::Hit), camera.pixel_count());
    greatest_step(&view)
}

/// Each texel is in one of two images from one place, by chance: side by side they have all.
#[test]
fn scattered_holes_leave_a_closed_wall() {
    let corners = Corners { eye: Vec3::Z * 4.0, target: Vec3::ZERO, half_m: 0.0 };
    let mut stage = Stage::new(quad(Vec3::ZERO, 3.0, Vec3::Z, [120, 160, 90]), &corners.samples(2));
    for (number, image) in stage.images.iter_mut().enumerate() {
        punch(image, |x, y| usize::from(by_chance(x, y)) == number);
    }
    let camera = corners.camera(0.0, 0.0, VIEW_PX);
    let view = stage.view(&camera, CARVE);
    let truth = stage.drawn_directly(&camera);
    assert_eq!(count(&view, ProvenanceKind::Hit), VIEW_PX.element_product() as usize);
    let off = |i: usize| (depths(&view)[i] / depths(&truth)[i] - 1.0).abs();
    let farthest = (0..depths(&view).len()).map(off).fold(0.0, f32::max);
    println!("farthest from the wall: {farthest:.2e} of its depth");
    assert!(farthest < 1e-3, "{farthest}");
    let agreement = Agreement::of(&view, &stage.twin(&camera, CARVE));
    assert!(agreement.is_good(), "{agreement:?}");
}

/// One of two, with no pattern that a pyramid could follow.
fn by_chance(x: u32, y: u32) -> bool {
    let mixed = (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77)).wrapping_mul(0xc2b2_ae3d);
    (mixed ^ mixed >> 15).wrapping_mul(0x27d4_eb2f) >> 31 == 1
}

/// A gradient over the world; two cameras may disagree by a factor, as highlights make them.
fn paint(image: &mut DepthImage, factor: f32) {
    let size = image.size_px();
    for (x, y) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))) {
        if let Some(point) = image.sample_in_world(x, y) {
            let grey = factor * (0.35 + 0.05 * point.x + 0.03 * point.y);
            image.color_rgb9e5[(y * size.x + x) as usize] = rgb9e5_from_linear(Vec3::splat(grey));
        }
    }
    assert!(linear_from_rgb9e5(image.color_rgb9e5[0]).is_finite());
}

fn greatest_step(view: &View) -> u8 {
    let width = view.size_px.x as usize;
    let step = |i: usize| (0..3).map(|c| view.srgb8[3 * i + c].abs_diff(view.srgb8[3 * i + 3 + c])).max().unwrap_or(0);
    (0..kinds(view).len() - 1).filter(|i| i % width != width - 1).map(step).max().unwrap_or(0)
}

#[test]
fn a_wall_that_only_passing_rays_reach_is_met() {
    let scene = poles(0.25);
    let eye = Vec3::Z * 4.0;
    let camera = looking(eye, Vec3::Z * -2.0, 60.0, SAMPLE_PX);
    // The same camera twice: the second image is what lies behind the first.
    let stage = Stage::apart(scene, &[camera, camera]);
    let behind = stage.images[1].inverse_depth_per_m.iter().filter(|&&d| d > 0.0).count();
    assert!(behind > 300, "{behind} samples behind the poles");
    let aside = looking(eye + Vec3::X * 0.4, Vec3::Z * -2.0, 40.0, VIEW_PX);
    let first = Stage { images: stage.images[..1].to_vec(), ..stage.clone() };
    let [alone, both] = [&first, &stage].map(|stage| count(&stage.view(&aside, CARVE), ProvenanceKind::Filled));
    println!("pixels filled: {alone} with one layer, {both} with two");
    assert!(both * 4 < alone, "{alone} {both}");
}

/// Ground half a footprint under a road: images that omit the road show the ground. It is so close that it could be taken
/// for the road.
#[test]
fn a_surface_close_behind_does_not_shine_through() {
    let mut scene = quad(Vec3::ZERO, 1.5, Vec3::Z, [230; 3]);
    scene.meshes.extend(quad(Vec3::Z * -0.02, 1.5, Vec3::Z, [20; 3]).meshes);
    scene.instances.push(scene::Instance { mesh: 1, ..scene.instances[0] });
    let corners = Corners { eye: Vec3::Z * 4.0, target: Vec3::ZERO, half_m: 0.4 };
    let stage = Stage::apart(scene, &corners.samples(3));
    let hidden = stage.images[1].passed.as_ref().expect("the second image shows the ground");
    assert!(hidden.iter().filter(|&&passed| passed).count() > 1000);
    let camera = looking(corners.eye, corners.target, 25.0, VIEW_PX);
    let view = stage.view(&camera, CARVE);
    let darkest = view.srgb8.iter().min().copied().unwrap_or(0);
    println!("darkest of the road: {darkest} of 230 codes");
    assert!(count(&view, ProvenanceKind::Hit) == VIEW_PX.element_product() as usize && darkest > 215, "{darkest}");
}
