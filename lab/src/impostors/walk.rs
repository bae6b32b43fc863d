//! What the walk along curved rays costs, by its steps and the image's side (Rosen et al., section 7.2).

use depth_image::{Camera, DepthImage};
use rayon::prelude::*;
use reconstruction::scalar::SinglePoleImages;
use reconstruction::{CurvedSearch, RayWork};
use report::{Bar, Cell, Check, Report, Table};
use sampling::Impostors;

use super::single_rays::{NEAR_M, Teapot};
use crate::statistics::median;

const REPEATS: usize = 5;
/// The paper's steps come first; the last takes no coarse steps.
const STEPS: [CurvedSearch; 7] = [
    CurvedSearch { coarse_px: 6.0, fine_px: 1.0 },
    CurvedSearch { coarse_px: 6.0, fine_px: 0.5 },
    CurvedSearch { coarse_px: 6.0, fine_px: 0.25 },
    CurvedSearch { coarse_px: 3.0, fine_px: 1.0 },
    CurvedSearch { coarse_px: 9.0, fine_px: 1.0 },
    CurvedSearch { coarse_px: 12.0, fine_px: 1.0 },
    CurvedSearch { coarse_px: 1.0, fine_px: 1.0 },
];
const SIDES_PX: [u32; 4] = [128, 256, 512, 1024];

struct Cost {
    steps_per_ray: f64,
    ns_per_ray: f64,
}

/// Adds tables and checks to a report.
///
/// # Errors
/// The device fails.
pub fn measure(teapot: &Teapot<'_>, report: &mut Report) -> anyhow::Result<()> {
    let cameras = teapot.cameras(Impostors::SinglePoles { images: 1 });
    let images = teapot.images(&cameras)?;
    let costs = STEPS.iter().map(|search| cost(teapot, &images, *search)).collect::<anyhow::Result<Vec<Cost>>>()?;
    let columns = [("coarse", "px"), ("fine", "px"), ("steps a ray", ""), ("ns a ray", ""), ("time over 6, 1", "×")];
    let mut table = Table::new("The walk of curved_search in a single-pole image of 512 × 512", &columns);
    for (search, cost) in STEPS.iter().zip(&costs) {
        let steps = [f64::from(search.coarse_px), f64::from(search.fine_px), cost.steps_per_ray];
        let times = [cost.ns_per_ray, cost.ns_per_ray / costs[0].ns_per_ray];
        table.push(steps.into_iter().chain(times).map(Cell::from))?;
    }
    report.tables.push(table);
    report.tables.push(by_side(teapot, &cameras)?);
    let steps: Vec<f64> = costs.iter().map(|cost| cost.steps_per_ray).collect();
    let coarse_ratio = steps[0] / steps[STEPS.len() - 1];
    report.checks.extend([
        Check::new("steps of 6, 1 over those of 1, 1", coarse_ratio, "×", Bar::AtMost(0.5)),
        Check::new("steps of 6, ½ over those of 6, 1 (the paper: 1.4)", steps[1] / steps[0], "×", Bar::AtMost(1.6)),
        Check::new("steps of 6, ¼ over those of 6, 1 (the paper: 2.2)", steps[2] / steps[0], "×", Bar::AtMost(2.5)),
    ]);
    Ok(())
}

fn by_side(teapot: &Teapot<'_>, cameras: &[Camera]) -> anyhow::Result<Table> {
    let columns = [("side", "px"), ("steps a ray", ""), ("ns a ray", "")];
    let mut table = Table::new("The walk by the side of the single-pole image", &columns);
    for side_px in SIDES_PX {
        let images = teapot.images(&Camera::resized_together(cameras, (side_px * side_px) as f32, 1))?;
        let cost = cost(teapot, &images, STEPS[0])?;
        table.push([Cell::from(side_px as usize), cost.steps_per_ray.into(), cost.ns_per_ray.into()])?;
    }
    Ok(table)
}

/// Steps are those of the scalar twin, times those of the device.
fn cost(teapot: &Teapot<'_>, images: &[DepthImage], search: CurvedSearch) -> anyhow::Result<Cost> {
    let twin = SinglePoleImages::of(images, &teapot.bounds);
    let steps: u64 = teapot.rays.par_iter().map(|ray| u64::from(twin.curved_search(ray, NEAR_M, search).steps)).sum();
    let set = teapot.set(images)?;
    let work = RayWork { curved_search: search, ..RayWork::new(&set, NEAR_M) };
    let mut times = Vec::new();
    for _ in 0..=REPEATS {
        times.push(teapot.stand.reconstructor().follow(work, &teapot.rays)?.1);
    }
    // The first use of a shader builds it.
    let times = times.split_off(1);
    let count = teapot.rays.len().max(1) as f64;
    Ok(Cost { steps_per_ray: steps as f64 / count, ns_per_ray: median(times) * 1e9 / count })
}
