//! Fronts of cost against error under expensive light, part of `study fronts`.
//!
//! The rows are not those of budgets: sets are of more sizes, direct drawing has up to 64 rays, and its error is the noise of few.

use std::path::Path;

use anyhow::Context as _;
use depth_image::LightCacheQuality::{self, Balanced, Fast, Fine};
use glam::UVec2;
use render::Lighting;
use report::{Bar, Check, Report};

use super::light::{DIRECT_RAYS, Light, LightRays};
use super::measure::{LightFront, LightRow, LitRows};
use super::report::add_to;
use super::subject::{OrbitViews, SetOptions, Subject, VIEW_PX};
use crate::failures::stand::Stand;
use crate::study::check_if_measured;

/// Two interiors, and two subjects that are seen from outside; the quick ones come first.
const SUBJECTS: [&str; 4] = ["courtyard, inside", "urban, inside", "tree-terrain-500k", "FlightHelmet"];
const QUICK_SUBJECTS: usize = 1;
const VIEWS: OrbitViews = OrbitViews { count: 8, size_px: VIEW_PX };
const QUICK_VIEWS: OrbitViews = OrbitViews { count: 3, size_px: UVec2::new(160, 90) };
const QUALITIES: [LightCacheQuality; 3] = [Fast, Balanced, Fine];
/// Numbers of sample images, and their densities.
const IMAGES: [usize; 2] = [1, 4];
const DENSITIES: [f32; 3] = [0.25, 0.5, 1.0];
/// Rows of a subject: all qualities with all sets, `joint_carve`, and direct drawing.
const ROWS: usize = QUALITIES.len() * IMAGES.len() * DENSITIES.len() + 1 + DIRECT_RAYS.len();
/// FLIP of direct drawing with the most rays over that with the fewest: the reference shows what rays bring.
const MOST_DIRECT_RATIO: f64 = 0.6;
/// FLIP of direct drawing over that of `balanced` in the same time, in interiors.
const LEAST_INDIRECT_RATIO: f64 = 1.5;
const LEAST_OCCLUSION_RATIO: f64 = 1.2;

pub fn subject_names(is_quick: bool) -> &'static [&'static str] {
    if is_quick { &SUBJECTS[..QUICK_SUBJECTS] } else { &SUBJECTS }
}

/// A subject under one lighting.
pub struct LitWork {
    /// `None` for a model without a folder of models.
    subject: Option<Subject>,
    name: &'static str,
    lighting: Lighting,
}

/// The named subjects under each light.
///
/// # Errors
/// The folder of models lacks one.
pub fn wanted(names: &[&'static str], lights: &[Light], models: Option<&Path>) -> anyhow::Result<Vec<LitWork>> {
    let mut wanted = Vec::new();
    for &name in names {
        for light in lights {
            let subject = Subject::new(name, models)?;
            wanted.push(LitWork { subject, name, lighting: light.lighting(rays(*light)).parse()? });
        }
    }
    Ok(wanted)
}

/// Rays a pixel of all rows but direct drawing.
fn rays(light: Light) -> LightRays {
    match light {
        Light::Indirect => LightRays::new(16, 64),
        Light::Occlusion => LightRays::new(16, 16),
    }
}

fn sets() -> Vec<SetOptions> {
    IMAGES
        .into_iter()
        .flat_map(|images| DENSITIES.map(|density| SetOptions { images, density, ..SetOptions::DEFAULT }))
        .collect()
}

/// Adds tables, charts and checks of all subjects.
///
/// # Errors
/// A scene cannot be used, or the device fails.
pub fn measure(stand: &Stand, wanted: &[LitWork], is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let views = if is_quick { QUICK_VIEWS } else { VIEWS };
    let rows =
        LitRows { direct: &DIRECT_RAYS, qualities: &QUALITIES, sets: sets(), has_joint_carve: true, views, runs: 1 };
    report.parameter("expensive light: views a row", format!("{} of {}", views.count, views.size_px));
    for LitWork { subject, name, lighting } in wanted {
        let Some(subject) = subject else {
            let name = format!("{name}, {lighting}: measured");
            report.checks.push(Check::not_run(name, "", Bar::Equal(1.0), "--models is not given"));
            continue;
        };
        let front = rows.measure(stand, subject, *lighting).with_context(|| format!("subject {name:?}"))?;
        add_to(report, &front)?;
        report.checks.extend(checks(&front));
    }
    Ok(())
}

fn checks(front: &LightFront) -> Vec<Check> {
    let name = front.name();
    let not_finite = front.rows.iter().filter(|row| !is_finite(row)).count();
    let mut checks = vec![
        Check::new(format!("{name}: rows"), front.rows.len() as f64, "", Bar::Equal(ROWS as f64)),
        Check::new(format!("{name}: rows with a figure that is no number"), not_finite as f64, "", Bar::Equal(0.0)),
        check_if_measured(
            format!("{name}: direct drawing, FLIP with the most rays over that with the fewest"),
            direct_ratio(front),
            "×",
            Bar::AtMost(MOST_DIRECT_RATIO),
            "no direct drawing",
        ),
    ];
    if front.is_interior {
        let shared = front.rows.iter().filter(|row| row.is_shared() && front.is_on_front(row)).count() as f64;
        let least = match front.light {
            Light::Indirect => LEAST_INDIRECT_RATIO,
            Light::Occlusion => LEAST_OCCLUSION_RATIO,
        };
        checks.push(Check::new(format!("{name}: rows of light_cache on the front"), shared, "", Bar::AtLeast(1.0)));
        checks.push(check_if_measured(
            format!("{name}: FLIP of direct drawing over that of `balanced` (S = 4, density 1) in the same time"),
            equal_time_ratio(front),
            "×",
            Bar::AtLeast(least),
            "the row is not measured",
        ));
    }
    checks
}

fn is_finite(row: &LightRow) -> bool {
    [row.view_ms, row.sampled.seconds, row.flip, row.psnr_db, row.unknown.unwrap_or(0.0)]
        .iter()
        .all(|figure| figure.is_finite())
}

fn direct_ratio(front: &LightFront) -> Option<f64> {
    let mut direct = front.rows.iter().filter(|row| row.is_direct());
    let fewest = direct.next()?;
    Some(direct.next_back()?.flip / fewest.flip)
}

/// Direct drawing that is slower than `balanced` even with the fewest rays is compared all the same.
fn equal_time_ratio(front: &LightFront) -> Option<f64> {
    let balanced = front.at_quality(Balanced)?;
    Some(front.direct().flip_at(balanced.view_ms)? / balanced.flip)
}

#[cfg(test)]
mod tests {
    use report::Outcome;

    use super::*;
    use crate::lit::measure::{Drawing, SamplingResult};

    /// Direct drawing halves its error in twice the time; shared light has one time and one error.
    fn front(shared_ms: f64, shared_flip: f64) -> LightFront {
        let row = |drawing, set, view_ms, flip| LightRow {
            drawing,
            set,
            view_ms,
            sampled: SamplingResult::default(),
            flip,
            psnr_db: 30.0,
            unknown: None,
        };
        let direct = |(step, rays)| {
            let factor = 2_f64.powi(step as i32);
            row(Drawing::Direct(rays), None, 100.0 * factor, 0.08 / factor)
        };
        let mut rows: Vec<LightRow> = DIRECT_RAYS.into_iter().enumerate().map(direct).collect();
        for set in sets() {
            rows.extend(QUALITIES.map(|q| row(Drawing::LightCache(q), Some(set), shared_ms, shared_flip)));
        }
        rows.push(row(Drawing::JointCarve, Some(SetOptions::DEFAULT), 20.0, 0.2));
        let truth = Light::Indirect.truth(DIRECT_RAYS[6]);
        let lighting = "soft 16, indirect 64".parse().unwrap();
        LightFront { subject: "a room", lighting, light: Light::Indirect, is_interior: true, truth, rows }
    }

    fn falls_short(front: &LightFront) -> usize {
        checks(front).iter().filter(|check| check.outcome() == Outcome::FallsShort).count()
    }

    #[test]
    fn shared_light_must_dominate_direct_drawing_of_the_same_time() {
        assert_eq!(falls_short(&front(200.0, 0.01)), 0);
        // As good as direct drawing of the same time, and on the front.
        assert_eq!(falls_short(&front(200.0, 0.039)), 1);
        // Slower and worse.
        assert_eq!(falls_short(&front(400.0, 0.05)), 2);
        assert_eq!(falls_short(&front(200.0, f64::NAN)), 2);
    }

    #[test]
    fn direct_drawing_that_gains_nothing_by_rays_and_missing_rows_fall_short() {
        let mut flat = front(200.0, 0.01);
        flat.rows[DIRECT_RAYS.len() - 1].flip = 0.07;
        assert_eq!(falls_short(&flat), 1);
        let mut short = front(200.0, 0.01);
        short.rows.pop();
        assert_eq!(falls_short(&short), 1);
    }
}
