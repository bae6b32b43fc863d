//! What a session gets that names neither a budget nor samples, beside the table of all rows.

use app_core::delivery::{Terms, request};
use app_core::experiment::Experiment;
use cluster::{Policy, SessionPlan, SessionRequest};
use depth_image::{Antialias, LightCacheQuality, PinholeCamera, SampleCamera, ViewPlanes};
use planner::Row;
use reconstruction::ReconstructionMethod;

use super::table::TableRow;

/// Numbers of views that share a sample set.
const VIEWS_A_SET: [usize; 3] = [1, 24, 290];

/// The default of a session.
#[derive(Debug, Clone)]
pub struct DefaultRow {
    pub scene: &'static str,
    pub views_a_set: usize,
    pub row: Row,
    /// The table's price of the default over that of the best row at `balanced`, or of direct drawing where that is best.
    pub price_ratio: f64,
}

/// Opens a session for each number of views, and compares the samples that its plan has.
///
/// # Errors
/// The cluster fails, or the table lacks a row.
pub fn defaults(
    experiment: &Experiment,
    scene: &'static str,
    view: PinholeCamera,
    table: &[TableRow],
) -> anyhow::Result<Vec<DefaultRow>> {
    let method = ReconstructionMethod::from(LightCacheQuality::Balanced).to_string();
    let usual = table.iter().filter(|row| match &row.row {
        Row::Samples { method: own, .. } => *own == method,
        Row::Direct { ray_ratio, .. } => *ray_ratio == 1.0,
    });
    let usual: Vec<&TableRow> = usual.collect();
    let mut rows = Vec::new();
    for views_a_set in VIEWS_A_SET {
        let settings = experiment.setup.offer.settings.clone();
        let settings = cluster::OfferSettings { method: None, ..settings };
        let request = request(settings, Terms::default(), &[view])?;
        let antialias = Antialias::of(4).unwrap_or_default();
        let planes = ViewPlanes { antialias, ..request.planes };
        let request = SessionRequest { views_per_set: views_a_set as u32, planes, ..request };
        let plan = experiment.receive(request, &[], |_| ())?.plan;
        let by_distance = usual.iter().map(|row| (distance(&row.row, &plan, &view), row));
        let Some((_, own)) = by_distance.min_by(|(a, _), (b, _)| a.total_cmp(b)) else { continue };
        let best_s = usual.iter().map(|row| row.price_s(views_a_set)).fold(f64::INFINITY, f64::min);
        let price_ratio = own.price_s(views_a_set) / best_s;
        rows.push(DefaultRow { scene, views_a_set, row: own.row.clone(), price_ratio });
    }
    Ok(rows)
}

/// How far a row is from a plan: none for the row that the plan has.
fn distance(row: &Row, plan: &SessionPlan, view: &PinholeCamera) -> f64 {
    let cameras = &plan.assignment.workload.sample_cameras;
    let is_direct = plan.assignment.policy == Policy::Direct;
    match row {
        Row::Direct { .. } => f64::from(u8::from(!is_direct)) * 100.0,
        Row::Samples { .. } if is_direct => 100.0,
        Row::Samples { camera_count, density, .. } => {
            let focal_px = cameras.first().and_then(SampleCamera::depth).map_or(1.0, |own| own.reference().focal_px.y);
            let density_of_plan = f64::from(focal_px / view.focal_px.y);
            (density / density_of_plan).log2().abs() + (f64::from(*camera_count) / cameras.len() as f64).log2().abs()
        }
    }
}
