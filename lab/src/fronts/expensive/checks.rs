//! Checks of fronts under expensive light.

use depth_image::LightCacheQuality::Balanced;
use report::{Bar, Check};

use super::measure::LightFront;
use super::rows::{Drawing, LightRow, ROWS};
use crate::lit_views::light::Light;
use crate::lit_views::subject::SetSize;

/// FLIP of direct drawing with the most rays over that with the fewest: the reference shows what rays bring.
const MOST_DIRECT_RATIO: f64 = 0.6;
/// FLIP of direct drawing over that of `balanced` in the same time, in interiors.
const LEAST_INDIRECT_RATIO: f64 = 1.5;
const LEAST_OCCLUSION_RATIO: f64 = 1.2;

pub fn checks(front: &LightFront) -> Vec<Check> {
    let name = |what: &str| format!("{}: {what}", front.name);
    let not_finite = front.rows.iter().filter(|row| !is_finite(row)).count();
    let mut checks = vec![
        Check::new(name("rows"), front.rows.len() as f64, "", Bar::Equal(ROWS as f64)),
        Check::new(name("rows with a figure that is no number"), not_finite as f64, "", Bar::Equal(0.0)),
        Check::maybe(
            name("direct drawing, FLIP with the most rays over that with the fewest"),
            direct_ratio(front),
            "×",
            Bar::AtMost(MOST_DIRECT_RATIO),
            "no direct drawing",
        ),
    ];
    if front.is_interior {
        let is_shared = |row: &&LightRow| matches!(row.drawing, Drawing::LightCache(_)) && front.is_on_front(row);
        let shared = front.rows.iter().filter(is_shared).count() as f64;
        let least = match front.light {
            Light::Indirect => LEAST_INDIRECT_RATIO,
            Light::Occlusion => LEAST_OCCLUSION_RATIO,
        };
        let dominance = "FLIP of direct drawing over that of `balanced` (S = 4, density 1) in the same time";
        checks.push(Check::new(name("rows of light_cache on the front"), shared, "", Bar::AtLeast(1.0)));
        checks.push(Check::maybe(
            name(dominance),
            equal_time_ratio(front),
            "×",
            Bar::AtLeast(least),
            "the row is not measured",
        ));
    }
    checks
}

/// Says that a subject is left out, since it is a file and no folder is given.
pub fn left_out(subject: &str) -> Check {
    Check::not_run(format!("{subject}: measured"), "", Bar::Equal(1.0), "--models is not given")
}

fn is_finite(row: &LightRow) -> bool {
    [row.view_ms, row.sampling_s, row.flip, row.psnr_db, row.unknown.unwrap_or(0.0)]
        .iter()
        .all(|figure| figure.is_finite())
}

fn direct_ratio(front: &LightFront) -> Option<f64> {
    let mut direct = front.rows.iter().filter(|row| matches!(row.drawing, Drawing::Direct(_)));
    let fewest = direct.next()?;
    Some(direct.next_back()?.flip / fewest.flip)
}

/// Direct drawing that is slower than `balanced` even with the fewest rays is compared all the same.
fn equal_time_ratio(front: &LightFront) -> Option<f64> {
    let is_balanced =
        |row: &&LightRow| row.drawing == Drawing::LightCache(Balanced) && row.set == Some(SetSize::DEFAULT);
    let balanced = front.rows.iter().find(is_balanced)?;
    Some(front.direct().flip_at(balanced.view_ms)? / balanced.flip)
}

#[cfg(test)]
mod tests {
    use report::Outcome;

    use super::super::rows::{DIRECT_RAYS, QUALITIES, sets};
    use super::*;

    /// Direct drawing halves its error in twice the time; shared light has one time and one error.
    fn front(shared_ms: f64, shared_flip: f64) -> LightFront {
        let row = |drawing, set, view_ms, flip| LightRow {
            drawing,
            set,
            view_ms,
            sampling_s: 1.0,
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
        rows.push(row(Drawing::JointCarve, Some(SetSize::DEFAULT), 20.0, 0.2));
        let truth = Light::Indirect.truth(DIRECT_RAYS[6]);
        LightFront { name: "a room".to_owned(), light: Light::Indirect, is_interior: true, truth, rows }
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
