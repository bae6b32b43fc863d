//! What the walk costs, by its steps, the image's side and the number of rays (Rosen et al., section 7.2, Table 1).

use std::slice;

use depth_image::Camera;
use glam::UVec2;
use reconstruction::{CurvedSearch, RayWork, SampleSet};
use report::{Bar, Cell, Check, Report, Table};

use super::found::SIDE_PX;
use super::teapot::{NEAR_M, Rays, Teapot, off_mirror, views};
use crate::statistics::median;

/// Of the views whose rays are followed.
pub const VIEW_PX: UVec2 = UVec2::new(320, 240);
/// The distortion of an image of [`SIDE_PX`].
const DISTORTION_PX: f32 = 120.0;
const REPEATS: usize = 5;
/// Coarse and fine steps; the first are the paper's usual ones.
const STEPS_PX: [[f32; 2]; 8] =
    [[6.0, 1.0], [6.0, 0.5], [6.0, 0.25], [3.0, 1.0], [9.0, 1.0], [12.0, 1.0], [16.0, 1.0], [1.0, 1.0]];
const SIDES_PX: [u32; 4] = [128, 256, 512, 1024];
/// Pictures and fine steps of Table 1.
const PICTURES_PX: [UVec2; 3] = [UVec2::new(640, 480), UVec2::new(800, 600), UVec2::new(1024, 768)];
const PATH_VIEWS: usize = 8;
const FINE_PX: [f32; 3] = [1.0, 0.5, 0.25];

/// Of all rays that come into the teapot's box.
struct Cost {
    steps: f64,
    ns_a_ray: f64,
}

/// Adds tables and checks to a report.
///
/// # Errors
/// The device fails.
pub fn measure(teapot: &Teapot<'_>, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let rays = in_box(teapot, off_mirror(teapot, &views(teapot, if is_quick { 4 } else { 12 }), VIEW_PX)?);
    let set = set(teapot, &rays, SIDE_PX)?;
    let costs = STEPS_PX.iter().map(|steps| cost(teapot, &set, &rays, *steps)).collect::<anyhow::Result<Vec<_>>>()?;
    let columns = [("coarse", "px"), ("fine", "px"), ("steps a ray", ""), ("ns a ray", ""), ("time over 6, 1", "×")];
    let mut table =
        Table::new("The walk of curved_search in a single-pole image of 512 × 512, off the mirror", &columns);
    for ([coarse, fine], cost) in STEPS_PX.iter().zip(&costs) {
        let numbers =
            [f64::from(*coarse), f64::from(*fine), cost.steps, cost.ns_a_ray, cost.ns_a_ray / costs[0].ns_a_ray];
        table.push(numbers.map(Cell::from))?;
    }
    report.tables.push(table);
    report.checks.extend(step_checks(&costs));
    report.tables.push(by_side(teapot, &rays)?);
    if !is_quick {
        report.tables.push(by_picture(teapot)?);
    }
    Ok(())
}

/// Those that come into the teapot's box: the others take no step.
fn in_box(teapot: &Teapot<'_>, rays: Rays) -> Rays {
    let bounds = teapot.bounds;
    let comes_in = |ray: &depth_image::Ray| {
        let [a, b] = [bounds.min, bounds.max].map(|corner| (corner - ray.origin_in_world) / ray.direction_in_world);
        a.min(b).max_element().max(0.0) < a.max(b).min_element()
    };
    let kept: Vec<_> =
        rays.rays.iter().zip(&rays.truth).filter(|(ray, _)| comes_in(ray)).map(|(r, t)| (*r, *t)).collect();
    let (own, truth) = kept.into_iter().unzip();
    Rays { rays: own, truth, ..rays }
}

fn set(teapot: &Teapot<'_>, rays: &Rays, side_px: u32) -> anyhow::Result<SampleSet> {
    let distortion_px = DISTORTION_PX * side_px as f32 / SIDE_PX as f32;
    teapot.set(&[Camera::SinglePole(teapot.camera(rays.middle, distortion_px, side_px))])
}

fn cost(teapot: &Teapot<'_>, set: &SampleSet, rays: &Rays, [coarse_px, fine_px]: [f32; 2]) -> anyhow::Result<Cost> {
    let work = |count_steps| {
        let curved_search = CurvedSearch { coarse_px, fine_px };
        RayWork { curved_search, count_steps, ..RayWork::new(set, NEAR_M) }
    };
    let follow = |count_steps| teapot.stand.reconstructor().follow(work(count_steps), &rays.rays);
    let steps: u64 = follow(true)?.0.iter().map(|end| u64::from(end.steps)).sum();
    // The first use of a shader builds it.
    follow(false)?;
    let times = (0..REPEATS).map(|_| Ok(follow(false)?.1)).collect::<anyhow::Result<Vec<f64>>>()?;
    let count = rays.rays.len() as f64;
    Ok(Cost { steps: steps as f64 / count, ns_a_ray: median(times) * 1e9 / count })
}

fn step_checks(costs: &[Cost]) -> Vec<Check> {
    let bars = [(14.0, 36.0), (18.0, 46.0), (27.0, 66.0)];
    let names = ["6, 1", "6, ½", "6, ¼"];
    let steps = names.iter().zip(bars).zip(costs).flat_map(|((name, (least, most)), cost)| {
        [("least", Bar::AtLeast(least)), ("most", Bar::AtMost(most))]
            .map(|(bound, bar)| Check::new(format!("steps of {name}, {bound}"), cost.steps, "", bar))
    });
    let over = |of: usize, from: usize| costs[of].ns_a_ray / costs[from].ns_a_ray;
    // From steps of 3 on, the paper's fall to 0.59, 0.49 and 0.46.
    let falls = [("6", 0, 0.59), ("9", 4, 0.49), ("12", 5, 0.46)].map(|(coarse, place, paper)| {
        let name = format!("time of coarse steps of {coarse} over 3, less the paper's {paper}");
        Check::new(name, (over(place, 3) - paper).abs(), "", Bar::AtMost(0.15))
    });
    steps.chain([Check::new("time of 6, ¼ over 6, 1", over(2, 0), "×", Bar::AtMost(2.1))]).chain(falls).collect()
}

fn by_side(teapot: &Teapot<'_>, rays: &Rays) -> anyhow::Result<Table> {
    let columns = [("side", "px"), ("steps a ray", ""), ("ns a ray", ""), ("time over half the side", "×")];
    let mut table = Table::new("The walk by the side of the single-pole image", &columns);
    let mut before = None;
    for side_px in SIDES_PX {
        let cost = cost(teapot, &set(teapot, rays, side_px)?, rays, STEPS_PX[0])?;
        let over = before.map_or(Cell::from(""), |before| Cell::from(cost.ns_a_ray / before));
        before = Some(cost.ns_a_ray);
        table.push([Cell::from(side_px as usize), Cell::from(cost.steps), Cell::from(cost.ns_a_ray), over])?;
    }
    Ok(table)
}

/// Table 1: reflections a second along a path, without the rest of the picture.
fn by_picture(teapot: &Teapot<'_>) -> anyhow::Result<Table> {
    let columns =
        [("picture", ""), ("fine", "px"), ("mean", "ms"), ("least", "ms"), ("most", "ms"), ("steps a ray", "")];
    let mut table = Table::new("The walk for all mirrored rays of a picture, along a path of 8 views", &columns);
    for size_px in PICTURES_PX {
        let path = views(teapot, PATH_VIEWS);
        let views = path.iter().map(|view| Ok(in_box(teapot, off_mirror(teapot, slice::from_ref(view), size_px)?)));
        let views = views.collect::<anyhow::Result<Vec<Rays>>>()?;
        let set = set(teapot, &views[0], SIDE_PX)?;
        for fine_px in FINE_PX {
            let of_views = views.iter().filter(|rays| !rays.rays.is_empty()).map(|rays| {
                let cost = cost(teapot, &set, rays, [6.0, fine_px])?;
                Ok([cost.ns_a_ray * rays.rays.len() as f64 * 1e-6, cost.steps])
            });
            let of_views = of_views.collect::<anyhow::Result<Vec<[f64; 2]>>>()?;
            let times: Vec<f64> = of_views.iter().map(|[time, _]| *time).collect();
            let mean = |place: usize| of_views.iter().map(|of| of[place]).sum::<f64>() / of_views.len() as f64;
            let [least, most] =
                [times.iter().copied().fold(f64::MAX, f64::min), times.iter().copied().fold(0.0, f64::max)];
            let picture = format!("{} × {}", size_px.x, size_px.y);
            let numbers = [f64::from(fine_px), mean(0), least, most, mean(1)].map(Cell::from);
            table.push([Cell::from(picture)].into_iter().chain(numbers))?;
        }
    }
    Ok(table)
}
