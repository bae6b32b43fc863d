//! The scene in its finest light, and what light of every quality costs.

use app_core::setup::SceneArgs;
use client::Frame;
use study::{Check, Report};

use super::{COMPARED_VIEWS, DemoArgs, pictures};
use crate::evaluate::{ALL_PLANES, Truth};
use crate::experiment::Experiment;
use crate::lighting_study::{self, Extent};

/// Tables and charts, all views in the finest light that was measured, and six of them beside the truth.
pub fn show(args: &DemoArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<Vec<Check>> {
    let mut frames: Vec<Frame> = Vec::new();
    let rows = lighting_study::measure(experiment, Extent::demo(args.quick), |delivered| frames = delivered.frames)?;
    let lamps = experiment.setup.scene.illumination.lights.len();
    lighting_study::report(&rows, lamps, report)?;
    if let Some(finest) = rows.last() {
        let lit = SceneArgs { lighting: finest.lighting, ..experiment.args.clone() };
        let truth = Truth::take(&experiment.engine, &experiment.setup, &lit, experiment.views(COMPARED_VIEWS)?)?;
        let views = truth.reconstruct(args.scene.method, ALL_PLANES)?;
        pictures::contact_sheet(&frames, &finest.lighting, report);
        pictures::comparisons(&truth, &views, report)?;
    }
    Ok(lighting_study::checks(&rows))
}
