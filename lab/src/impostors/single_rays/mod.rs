//! Single rays in images of the teapot: what pinholes and single-pole cameras show of it, and what the walk along curved rays
//! costs (Rosen et al., sections 4 and 7.2).

mod bow;
mod bowl;
mod choices;
mod fade;
mod found;
mod steps;
mod teapot;

use app_core::progress::bar;
use report::Report;

use crate::failures::stand::Stand;
use teapot::{Teapot, off_mirror, off_patch, views};

/// Rays off a flat patch, in full and in quick runs.
const PATCH_RAYS: [usize; 2] = [40_000, 10_000];
/// Views around the mirror whose rays are followed.
const VIEWS: [usize; 2] = [12, 4];

/// The distortion under which edges bow.
const BOW_PX: f32 = 120.0;

/// Adds all tables, charts and checks to a report.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let teapot = Teapot::new(stand)?;
    let progress = bar("single rays", 4);
    let patch = |ratio: f32| off_patch(&teapot, ratio, PATCH_RAYS[usize::from(is_quick)]);
    let flat = found::compare(&teapot, &patch(1.0))?;
    progress.inc(1);
    let off_mirror = off_mirror(&teapot, &views(&teapot, VIEWS[usize::from(is_quick)]), steps::VIEW_PX)?;
    let mirror = found::compare(&teapot, &off_mirror)?;
    progress.inc(1);
    let curve = found::by_distortion(&teapot, patch)?;
    progress.inc(1);
    report.tables.push(found::table("Rays off a flat patch as wide as it is far that meet the teapot", &flat)?);
    report.tables.push(found::table("Rays off the mirror of teapot-mirror that meet the teapot", &mirror)?);
    report.charts.push(curve.into());
    report.charts.push(bow::measure(&teapot.camera(off_mirror.middle, BOW_PX, found::SIDE_PX))?.into());
    report.tables.push(fade::measure(&teapot, &off_mirror)?);
    report.checks.extend(found::checks(&flat)?);
    report.checks.extend(found::checks_of_mirror(&mirror)?);
    steps::measure(&teapot, is_quick, report)?;
    report.checks.extend(bowl::measure(stand)?);
    let (choices, checks) = choices::measure(stand)?;
    report.tables.push(choices);
    report.checks.extend(checks);
    progress.finish_and_clear();
    Ok(())
}
