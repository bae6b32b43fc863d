//! The budget of a session, and the representations that its own choices leave.

use std::collections::BTreeSet;

use cluster::{DIRECT, SessionRequest, Workload};
use planner::{Budget, Row};
use tonic::Status;

use crate::config::{CoordinatorConfig, SceneOffer};
use crate::schedule::Budgeted;

/// The session's budget, else the coordinator's; `None` without either, and where the coordinator's leaves nothing to choose.
///
/// # Errors
/// The session's text is no budget, or leaves nothing to choose.
pub(crate) fn budgeted(
    request: &SessionRequest,
    workload: &Workload,
    offer: &SceneOffer,
    config: &CoordinatorConfig,
) -> Result<Option<Budgeted>, Status> {
    let own = request.budget.budget.as_deref().map(str::parse::<Budget>).transpose();
    let own = own.map_err(|error| Status::invalid_argument(format!("budget: {error}")))?;
    let Some(budget) = own.or(config.budget) else { return Ok(None) };
    let has_own = offer.keeps_cameras || !request.sample_cameras.is_empty();
    let keeps_cameras = has_own && request.viewpoints.is_empty();
    let rows = rows(request, offer, keeps_cameras.then_some(workload.sample_cameras.len() as u32));
    let first = match workload.sample_cameras.first() {
        _ if !workload.common_cells.is_empty() => {
            Err("budget: none can be kept for mirrors that show the scene, and beside a base or blocks")
        }
        _ if workload.samples_cube() => Err("budget: none can be kept for a layered cube"),
        Some(first) if !rows.is_empty() => Ok(first),
        _ => Err("budget: the session's own choices leave no representation"),
    };
    let first = match first {
        Ok(first) => first,
        Err(reason) if own.is_some() => return Err(Status::invalid_argument(reason)),
        Err(_) => return Ok(None),
    };
    let screening = (config.screening_light)(&workload.lighting);
    let budgeted = Budgeted {
        budget,
        rows,
        whole_px: first.size_px(),
        keeps_cameras,
        typical_view: request.typical_view,
        antialias_samples: request.planes.antialias.samples(),
        codec: request.codec.clone(),
        screening_lighting: screening.unwrap_or_else(|| workload.lighting.clone()),
    };
    budgeted.validate().map_err(|error| Status::invalid_argument(format!("budget: {error}")))?;
    Ok(Some(budgeted))
}

/// The offer's rows as far as the session has not named another method, another size or its own cameras.
fn rows(request: &SessionRequest, offer: &SceneOffer, own_cameras: Option<u32>) -> Vec<Row> {
    if request.method == DIRECT {
        return Vec::new();
    }
    let has_size = request.sample_size_px.is_some() || !offer.fits_views;
    let mut rows = offer.rows.clone();
    if request.budget.names_method {
        rows = with_method(rows, &request.method);
    }
    rows.retain(|row| !has_size || row.side_ratio == 1.0);
    if let Some(count) = own_cameras {
        // Layers are of one place, and the cameras have several.
        rows.retain(|row| row.place_count == row.camera_count);
        rows.iter_mut().for_each(|row| (row.camera_count, row.place_count) = (count, count));
    }
    let mut seen = BTreeSet::new();
    rows.retain(|row| {
        seen.insert((row.sampling.clone(), row.method.clone(), row.camera_count, row.side_ratio.to_bits()))
    });
    rows
}

/// The rows of a method with its setting; where the ladder has another setting or none of it, one row for each way to sample.
fn with_method(rows: Vec<Row>, method: &str) -> Vec<Row> {
    if rows.iter().any(|row| row.method == method) {
        return rows.into_iter().filter(|row| row.method == method).collect();
    }
    let renamed = rows.into_iter().map(|row| {
        let [sampling, base] = [&row.sampling, method].map(|name| name.split(':').next().unwrap_or_default());
        Row { method: method.to_owned(), kind: format!("{sampling} {base}"), rank: 0, ..row }
    });
    renamed.collect()
}
