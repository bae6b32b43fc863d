//! The scene in its finest light, and the cost of every lighting.

use app_core::setup::SceneArgs;
use client::Frame;
use depth_image::ViewPlanes;
use study::Report;

use super::args::{COMPARED_VIEWS, DemoArgs};
use super::pictures;
use crate::experiment::Experiment;
use crate::lighting_study::{self, Extent, Row};
use crate::reference_views::ReferenceViews;

/// Adds tables and charts, all views in the finest light, and six of them beside reference views.
pub fn show(args: &DemoArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<Vec<Row>> {
    let mut frames: Vec<Frame> = Vec::new();
    let rows = lighting_study::measure(experiment, Extent::demo(args.quick), |frame| frames.push(frame))?;
    frames.sort_by_key(|frame| frame.request.frame);
    let lamps = experiment.setup.scene.illumination.lights.len();
    lighting_study::report(&rows, lamps, report)?;
    if let Some(finest) = rows.last() {
        let lit = SceneArgs { lighting: finest.lighting, ..experiment.args.clone() };
        let reference =
            ReferenceViews::draw(&experiment.engine, &experiment.setup, &lit, experiment.views(COMPARED_VIEWS)?)?;
        let views = reference.reconstruct(args.scene.method(), ViewPlanes::ALL)?;
        pictures::contact_sheet(&frames, &finest.lighting, report);
        pictures::comparisons(&reference, &views, report)?;
    }
    Ok(rows)
}
