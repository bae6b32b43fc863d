//! A still camera in a still scene: every method must give equal bytes.

use app_core::planning::Planning;
use cluster::Refinement;
use glam::Vec2;

use super::measure::Stand;
use super::paths::{CAMERAS, SetOfPath};

/// Views of a batch beside the same view alone.
const BATCH: usize = 3;

/// The rows whose view differs where its set is sampled again, or where it is made in a batch; and the number of rows.
///
/// # Errors
/// The device fails.
pub fn differing_rows(stand: &Stand<'_>, planning: &Planning) -> anyhow::Result<(Vec<String>, usize)> {
    let camera = planning.viewpoints.cell.camera_at(Vec2::new(0.3, -0.2), planning.viewpoints.view_px);
    let mut differing = Vec::new();
    let mut count = 0;
    for (row, of) in planning.ladder.rows().iter().zip(&planning.representations) {
        if (row.camera_count, row.side_ratio) != (CAMERAS, 1.0) {
            continue;
        }
        let set = SetOfPath { representation: of.clone(), time_s: 0.0, refinement: Refinement::default() };
        let mut views = Vec::new();
        for batch in [1, BATCH] {
            let uploaded = stand.upload(&stand.sample(&set)?)?;
            views.extend(stand.views(uploaded.as_ref(), of, vec![camera; batch])?);
        }
        count += 1;
        if views.iter().any(|view| view.srgb8 != views[0].srgb8) {
            differing.push(row.to_string());
        }
    }
    anyhow::ensure!(count > 0, "the ladder has no row of {CAMERAS} cameras");
    Ok((differing, count))
}
