//! Measurements whose errors are a third of the true ones, as a faulty device may leave them.

use std::path::Path;

use anyhow::Context as _;
use planner::{Certificate, Kept, KeptKey, KeptRow, ViewErrors};

/// A third of the errors of the kept measurements in a folder, written to another, and a budget that the cheapest certified
/// row seems to keep.
///
/// # Errors
/// There are no measurements, or none with a certificate.
pub(super) fn forge(from: &Path, to: &Path) -> anyhow::Result<String> {
    let mut budget = None;
    for entry in from.read_dir()? {
        let entry = entry?;
        let json = std::fs::read(entry.path())?;
        let key: KeptKey = serde_json::from_value(serde_json::from_slice::<serde_json::Value>(&json)?["key"].take())?;
        let mut kept = Kept::from_json(&json, &key)?;
        budget = promised(&kept).or(budget);
        let Some(text) = &budget else { continue };
        for row in &mut kept.rows {
            *row = third(row, text)?;
        }
        kept.searches.clear();
        std::fs::write(to.join(entry.file_name()), kept.to_json()?)?;
    }
    budget.context("no row is certified")
}

/// A little above a third of the bound of the first certified row.
fn promised(kept: &Kept) -> Option<String> {
    let certificate = kept.rows.iter().find_map(|row| row.certificates.last())?;
    Some(format!("flip {:.5}", certificate.bound_ratio / 3.0 * 1.02))
}

fn third(row: &KeptRow, budget: &str) -> anyhow::Result<KeptRow> {
    let errors = |errors: &ViewErrors| ViewErrors {
        flip: errors.flip / 3.0,
        flip_whole: errors.flip_whole / 3.0,
        mean_square: errors.mean_square / 9.0,
        ..*errors
    };
    let screening = row.screening.iter().map(errors).collect();
    let budget = budget.parse()?;
    let certificate = |certificate: &Certificate| Certificate {
        budget,
        expected_ratio: certificate.expected_ratio / 3.0,
        bound_ratio: certificate.bound_ratio / 3.0,
        ..certificate.clone()
    };
    let certificates = row.certificates.iter().map(certificate).collect();
    Ok(KeptRow { certificates, costs: row.costs.clone(), ..KeptRow::new(row.row.clone(), screening) })
}
