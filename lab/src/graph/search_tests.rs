use glam::UVec2;

use super::*;
use crate::graph::camera::{GraphCamera, Layout};
use crate::graph::test_support::Zigzag;

const STEPS: GraphSearch = GraphSearch { coarse_px: 6.0, fine_px: 1.0 };
const RAYS: u32 = 600;
const RIGHT_M: f64 = 0.06;

struct Found {
    share: f64,
    steps_per_ray: f64,
}

fn found(zigzag: &Zigzag, camera: &GraphCamera, search: GraphSearch) -> Found {
    let image = GraphImage::take(camera, |ray, span| zigzag.meet(ray, span));
    let mut met = 0;
    let mut right = 0;
    let mut steps = 0;
    for ray in (0..RAYS).map(|number| zigzag.ray(number)) {
        let Some(truth) = zigzag.meet(&ray, [1e-3, 100.0]) else { continue };
        let end = image.follow(&ray, 1e-3, search);
        let is_right = end.met.is_some_and(|hit| (hit.way_m - f64::from(truth.t)).abs() < RIGHT_M);
        met += 1;
        right += u32::from(is_right);
        steps += end.steps;
    }
    assert!(met > RAYS / 2, "{met}");
    Found { share: f64::from(right) / f64::from(met), steps_per_ray: f64::from(steps) / f64::from(met) }
}

#[test]
fn rays_through_corridors_end_where_they_meet_walls() {
    let zigzag = Zigzag::new(3, UVec2::new(480, 300));
    let nested = found(&zigzag, &zigzag.camera(&Layout::Nested), STEPS);
    assert!(nested.share > 0.95, "{}", nested.share);
    let apart = found(&zigzag, &zigzag.camera(&Layout::Apart(vec![UVec2::new(277, 173); 3])), STEPS);
    assert!(apart.share > 0.96, "{}", apart.share);
}

/// The paper: fewer steps with coarse ones than without, more with finer ones.
#[test]
fn coarse_steps_save_looks_and_fine_ones_cost_them() {
    let zigzag = Zigzag::new(3, UVec2::new(480, 300));
    let camera = zigzag.camera(&Layout::Nested);
    let steps = |coarse_px, fine_px| found(&zigzag, &camera, GraphSearch { coarse_px, fine_px }).steps_per_ray;
    let [without, coarse, half, quarter] = [steps(1.0, 1.0), steps(6.0, 1.0), steps(6.0, 0.5), steps(6.0, 0.25)];
    assert!(coarse < 0.6 * without, "{coarse} of {without}");
    assert!(coarse < half && half < quarter, "{coarse}, {half}, {quarter}");
}

/// A floor that goes on through a face is one surface: its cells are connected there.
#[test]
fn faces_show_no_cracks() {
    let zigzag = Zigzag::new(2, UVec2::new(240, 150));
    let camera = zigzag.camera(&Layout::Nested);
    let image = GraphImage::take(&camera, |ray, span| zigzag.meet(ray, span));
    let part = &image.parts[0];
    let mut across = 0;
    let mut torn = 0;
    for cell in (0..149).flat_map(|y| (0..239).map(move |x| UVec2::new(x, y))) {
        let corners: Vec<Sample> = part.corners(cell).into_iter().flatten().collect();
        let is_one_color = corners.windows(2).all(|pair| pair[0].color_linear() == pair[1].color_linear());
        let is_across = corners.windows(2).any(|pair| pair[0].frustum() != pair[1].frustum());
        if corners.len() == 4 && is_one_color && is_across {
            across += 1;
            torn += u32::from(!part.is_connected(cell));
        }
    }
    assert!(across > 50 && torn * 20 < across, "{torn} of {across}");
}
