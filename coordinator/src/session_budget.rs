//! The budget of a session, and the representations that its own choices leave.

use std::collections::BTreeSet;

use cluster::{DIRECT, SessionRequest, Workload};
use depth_image::Camera;
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
    let Some(Camera::Pinhole(first)) = workload.sample_cameras.first().filter(|_| !rows.is_empty()) else {
        return match own {
            None => Ok(None),
            Some(_) => Err(Status::invalid_argument("budget: the session's own choices leave no representation")),
        };
    };
    let screening = (config.screening_light)(&workload.lighting);
    let budgeted = Budgeted {
        budget,
        rows,
        whole_px: first.size_px,
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
        rows = named(rows, &request.method, |row| &mut row.method);
    }
    if request.budget.names_sampling {
        rows = named(rows, &request.sampling, |row| &mut row.sampling);
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

/// The rows of the named setting; where there are none, those of the same method, or else all, with that setting.
fn named(rows: Vec<Row>, setting: &str, of: fn(&mut Row) -> &mut String) -> Vec<Row> {
    let base = |text: &str| text.split(':').next().unwrap_or_default().to_owned();
    let matching = |is: &dyn Fn(&str) -> bool| -> Vec<Row> {
        rows.iter().filter(|row| is(of(&mut (*row).clone()))).cloned().collect()
    };
    let exact = matching(&|text| text == setting);
    if !exact.is_empty() {
        return exact;
    }
    let alike = matching(&|text| base(text) == base(setting));
    let mut rows = if alike.is_empty() { rows } else { alike };
    for row in &mut rows {
        *of(row) = setting.to_owned();
        row.kind = format!("{} {}", base(&row.sampling), base(&row.method));
        row.rank = 0;
    }
    rows
}
