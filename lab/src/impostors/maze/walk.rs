//! What the search in a graph image costs by its steps (Rosen et al., section 7.2 and Table 1).

use report::{Bar, Cell, Check, Report, Table};

use super::found::search_cost;
use super::subject::MirroredRay;
use crate::graph::{GraphImage, GraphSearch};
use crate::statistics::median;

const REPEATS: usize = 3;

/// The frames a second of the paper's teapot in a single-pole image, and the steps in its graph image.
struct PaperRow {
    coarse_px: f64,
    fine_px: f64,
    frames_per_s: Option<f64>,
    steps: Option<f64>,
}

const fn row(coarse_px: f64, fine_px: f64, frames_per_s: Option<f64>, steps: Option<f64>) -> PaperRow {
    PaperRow { coarse_px, fine_px, frames_per_s, steps }
}

/// Fine steps at 640 × 480, coarse steps, and a search without coarse steps.
const ROWS: [PaperRow; 7] = [
    row(6.0, 1.0, Some(26.5), Some(27.0)),
    row(6.0, 0.5, Some(20.7), None),
    row(6.0, 0.25, Some(15.0), None),
    row(3.0, 1.0, Some(18.2), None),
    row(9.0, 1.0, Some(37.2), None),
    row(12.0, 1.0, Some(39.8), None),
    row(1.0, 1.0, None, Some(155.0)),
];
const COLUMNS: [(&str, &str); 6] = [
    ("coarse", "px"),
    ("fine", "px"),
    ("steps a ray", ""),
    ("a ray", "ns"),
    ("the paper's steps (maze)", ""),
    ("the paper's frames (teapot)", "1/s"),
];

/// Adds the table and its checks to a report.
///
/// # Errors
/// A row does not fit the table.
pub fn measure(name: &str, image: &GraphImage<'_>, rays: &[MirroredRay], report: &mut Report) -> anyhow::Result<()> {
    let mut table = Table::new(format!("The search in a nested graph image of {name}, by its steps"), &COLUMNS);
    let mut steps = Vec::new();
    for PaperRow { coarse_px, fine_px, frames_per_s, steps: paper_steps } in ROWS {
        let costs = (0..REPEATS).map(|_| search_cost(image, rays, GraphSearch { coarse_px, fine_px }));
        let costs: Vec<_> = costs.collect();
        steps.push(costs[0].steps_per_ray);
        let ns_per_ray = median(costs.iter().map(|cost| cost.ns_per_ray).collect());
        let measured = [coarse_px, fine_px, costs[0].steps_per_ray, ns_per_ray].map(Cell::from);
        table.push(measured.into_iter().chain([paper_steps.into(), frames_per_s.into()]))?;
    }
    report.tables.push(table);
    let saved = steps[0] / steps[ROWS.len() - 1];
    report.checks.push(Check::new(
        format!("{name}: steps of 6, 1 over those of 1, 1 (the paper: 0.17)"),
        saved,
        "×",
        Bar::AtMost(0.5),
    ));
    Ok(())
}
