//! Where methods fail, as curves (METHODS §9): each test holds the curve's shape and prints it.

use depth_image::{PinholeCamera, ProvenanceKind, View};
use glam::{UVec2, Vec3};
use reconstruction::ReconstructionMethod;
use scene::procedural::{courtyard, poles, quad, uv_sphere};

use crate::stage::{CARVE, Corners, SAMPLE_PX, Stage, VIEW_PX, count, depths, kinds, looking};

fn search(steps: u32) -> ReconstructionMethod {
    ReconstructionMethod::LightFieldSearch { steps }
}

/// Share of the pixels of poles, in truth, that the view holds at about the poles' depth.
fn recall_of_poles(truth: &View, view: &View) -> f64 {
    // Poles stand 5 m away, the wall 7 m.
    let is_pole = |inverse: f32| inverse > 1.0 / 6.0;
    let poles: Vec<usize> = (0..depths(truth).len()).filter(|&i| is_pole(depths(truth)[i])).collect();
    assert!(!poles.is_empty(), "no pole is seen");
    let found = poles.iter().filter(|&&i| kinds(view)[i] == ProvenanceKind::Hit && is_pole(depths(view)[i]));
    found.count() as f64 / poles.len() as f64
}

#[test]
fn few_steps_miss_thin_poles_and_the_carve_does_not() {
    let corners = Corners { eye: Vec3::Z * 4.0, target: Vec3::Z * -2.0, half_m: 0.4 };
    let methods = [search(8), search(32), search(128), CARVE];
    println!(
        "recall of poles; one sample pixel is {:.3} m there",
        2.0 * 5.0 * 22.5f32.to_radians().tan() / SAMPLE_PX.y as f32
    );
    println!("radius_m  8 steps 32 steps 128 steps    carve");
    let mut rows = Vec::new();
    for radius_m in [0.15, 0.08, 0.04, 0.03] {
        let stage = Stage::new(poles(radius_m), &corners.samples(4));
        let truth = stage.drawn_directly(&corners.view());
        let recalls = methods.map(|method| recall_of_poles(&truth, &stage.view(&corners.view(), method)));
        println!("{radius_m:<8} {:>8.3} {:>8.3} {:>8.3} {:>8.3}", recalls[0], recalls[1], recalls[2], recalls[3]);
        rows.push(recalls);
    }
    assert!(rows[0][3] > 0.9, "the carve finds thick poles: {:?}", rows[0]);
    assert!(rows.iter().all(|[few, .., carve]| carve >= few), "the carve is never worse than eight steps: {rows:?}");
    assert!(rows[2][0] < rows[2][3] - 0.2, "eight steps miss thin poles: {:?}", rows[2]);
    assert!(rows.iter().all(|r| r[2] >= r[0]), "more steps find more: {rows:?}");
}

/// Mean error in depth, relative, where both hit.
fn depth_error(truth: &View, view: &View) -> f64 {
    let (kt, kv) = (kinds(truth), kinds(view));
    let both = (0..kt.len()).filter(|&i| [kt[i], kv[i]] == [ProvenanceKind::Hit; 2]);
    let errors: Vec<f64> = both.map(|i| f64::from((depths(view)[i] / depths(truth)[i] - 1.0).abs()).min(0.1)).collect();
    assert!(errors.len() > 100, "{} pixels", errors.len());
    errors.iter().sum::<f64>() / errors.len() as f64
}

fn sphere() -> (Stage, PinholeCamera) {
    let corners = Corners { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.3 };
    (Stage::new(uv_sphere(1.0, 64), &corners.samples(4)), corners.view())
}

#[test]
fn error_falls_with_steps_then_stays() {
    let (stage, camera) = sphere();
    let truth = stage.drawn_directly(&camera);
    let errors =
        [2, 4, 8, 16, 64, 256, 1024].map(|steps| (steps, depth_error(&truth, &stage.view(&camera, search(steps)))));
    for (steps, error) in errors {
        println!("{steps:>5} steps: mean depth error {:.4} %", error * 100.0);
    }
    println!("      carve: mean depth error {:.4} %", 100.0 * depth_error(&truth, &stage.view(&camera, CARVE)));
    let [first, .., before_last, last] = errors.map(|(_, error)| error);
    assert!(first > 1.2 * last, "more steps help at first: {errors:?}");
    assert!((before_last / last - 1.0).abs() < 0.1, "and then no more: {errors:?}");
}

/// From outside, below the walls' tops, no camera sees the yard; a view from above shows all of it.
#[test]
fn disoccluded_pixels_are_marked() {
    let samples = [0.0f32, 0.4, 0.8, 1.2]
        .map(|a| looking(Vec3::new(9.0 * a.cos(), 1.7, 9.0 * a.sin()), Vec3::Y, 45.0, SAMPLE_PX));
    let stage = Stage::new(courtyard(), &samples);
    let above = looking(Vec3::new(0.5, 9.0, 0.5), Vec3::ZERO, 35.0, VIEW_PX);
    let truth = stage.drawn_directly(&above);
    // The yard's floor and pillar: lower than the walls, inside them.
    let yard: Vec<usize> = (0..VIEW_PX.element_product())
        .filter(|&i| {
            let at = UVec2::new(i % VIEW_PX.x, i / VIEW_PX.x).as_vec2() + 0.5;
            let depth = depths(&truth)[i as usize];
            let point = above.ray(at).at(depth.recip());
            depth > 0.0 && point.x.abs() < 1.6 && point.z.abs() < 1.6 && point.y < 0.9
        })
        .map(|i| i as usize)
        .collect();
    assert!(yard.len() > 100, "the view sees the yard: {}", yard.len());
    println!("of {} pixels of the yard:", yard.len());
    for method in [search(64), search(256), CARVE] {
        let view = stage.view(&above, method);
        let kind = |wanted| yard.iter().filter(|&&i| kinds(&view)[i] == wanted).count();
        let [empty, hit, filled] = [ProvenanceKind::Empty, ProvenanceKind::Hit, ProvenanceKind::Filled].map(kind);
        println!("{:<24} {hit:>4} hit (false) {filled:>4} filled {empty:>4} empty", method.to_string());
        if method == CARVE {
            assert!(filled * 10 > yard.len() * 8, "unseen pixels are marked: {filled} of {}", yard.len());
        }
    }
}

/// Inverse depth of samples rounded to a number of bits over the image's range, as a codec would.
fn quantised(stage: &Stage, bits: u32) -> Stage {
    let mut coarse = stage.clone();
    for image in &mut coarse.images {
        let (least, greatest) = image.inverse_depth_range().expect("samples");
        let step = (greatest - least) / ((1u32 << bits) - 1) as f32;
        let samples = image.inverse_depth_per_m.iter_mut().filter(|d| **d > 0.0);
        samples.for_each(|d| *d = least + ((*d - least) / step).round() * step);
    }
    coarse
}

#[test]
fn error_falls_with_bits_of_depth_then_stays() {
    let (stage, camera) = sphere();
    let truth = stage.drawn_directly(&camera);
    let whole = depth_error(&truth, &stage.view(&camera, CARVE));
    let errors =
        [6, 8, 10, 12, 14, 16].map(|bits| (bits, depth_error(&truth, &quantised(&stage, bits).view(&camera, CARVE))));
    for (bits, error) in errors {
        println!("{bits:>3} bits: mean depth error {:.4} %", error * 100.0);
    }
    println!("unrounded: mean depth error {:.4} %", whole * 100.0);
    assert!(errors[0].1 > 1.2 * whole, "{errors:?}");
    assert!((errors[5].1 / whole - 1.0).abs() < 0.05, "sixteen bits cost nothing: {errors:?}, {whole}");
    assert!(errors.windows(2).all(|pair| pair[1].1 < pair[0].1 * 1.05), "{errors:?}");
}

/// A surface on the very face of the volume is met only as far as the volume's padding covers the error of the samples'
/// depth. That error is a texel's staircase for the search, half a code for the carve.
#[test]
fn the_search_needs_room_behind_a_surface() {
    let corners = Corners { eye: Vec3::Z * 4.0, target: Vec3::ZERO, half_m: 0.5 };
    let stage = Stage::new(quad(Vec3::ZERO, 1.0, Vec3::Z, [200, 60, 40]), &corners.samples(4));
    let covered = count(&stage.drawn_directly(&corners.view()), ProvenanceKind::Hit);
    println!("margin_m  search:64  carve   of {covered} pixels");
    let rows = [0.0f32, 0.01, 0.03, 0.1, 0.3].map(|margin_m| {
        let roomy = Stage { volume: stage.volume.padded(margin_m), ..stage.clone() };
        let hits = [search(64), CARVE].map(|method| count(&roomy.view(&corners.view(), method), ProvenanceKind::Hit));
        println!("{margin_m:<9} {:>9} {:>6}", hits[0], hits[1]);
        hits
    });
    assert!(rows.iter().all(|[_, carve]| carve * 100 >= covered * 97), "{rows:?}");
    assert!(rows[4][0] * 100 >= covered * 95 && rows[4][0] >= rows[0][0], "{rows:?}");
}
