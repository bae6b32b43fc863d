//! A still camera in a still scene: every method must give equal bytes.

use cluster::Refinement;
use glam::Vec2;
use reconstruction::ReconstructionMethod;

use super::measure::Stand;
use super::paths::{CAMERAS, SetOfPath};
use super::subject::Representation;

/// Views of a batch beside the same view alone.
const BATCH: usize = 3;

/// The methods whose view differs where its set is sampled again, or where it is made in a batch; and the number of methods.
///
/// # Errors
/// The device fails.
pub fn differing_methods(stand: &Stand<'_>) -> anyhow::Result<(Vec<String>, usize)> {
    let subject = stand.subject;
    let camera = subject.cell.camera_at(Vec2::new(0.3, -0.2), subject.view_px);
    let samplings = sampling::METHODS.into_iter().map(|row| row.method);
    let mut differing = Vec::new();
    let mut count = 0;
    for sampling in samplings.filter(|sampling| sampling.layer_selection().is_none()) {
        for method in ReconstructionMethod::from_images() {
            let cameras = sampling.cameras(subject.usual(CAMERAS).cameras);
            let of = Representation { sampling, method, cameras };
            let set = SetOfPath { representation: of.clone(), time_s: 0.0, refinement: Refinement::default() };
            let mut views = Vec::new();
            for batch in [1, BATCH] {
                let uploaded = stand.upload(&set)?;
                views.extend(stand.views(uploaded.as_ref(), &of, vec![camera; batch])?);
            }
            count += 1;
            if views.iter().any(|view| view.srgb8 != views[0].srgb8) {
                differing.push(format!("{sampling}, {method}"));
            }
        }
    }
    Ok((differing, count))
}
