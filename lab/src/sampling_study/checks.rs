//! Checks of the relations that the paper finds.

use report::{Bar, Check};
use sampling::{Redundancy, SamplingMethod};

use super::availability::Availability;
use super::counts::percent;
use super::methods::IMAGES;
use super::scene::SceneRow;

/// Percentage points by which an availability may be below another's.
const ROOM_POINTS: f64 = 0.5;

const PIXEL: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Pixel);
const VISIBILITY: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Visibility);
const TOLERANCE: SamplingMethod = SamplingMethod::NonRedundant(Redundancy::Tolerance);
const PEELING: SamplingMethod = SamplingMethod::DepthPeeling { layers: IMAGES as u32 };

pub(super) fn checks(row: &SceneRow) -> Vec<Check> {
    let name = &row.name;
    let redundant = |method| -> usize {
        row.of(&row.counts, method).map_or(0, |images| images.iter().map(|image| image.redundant).sum())
    };
    let samples: usize = row.counts.iter().flatten().map(|image| image.samples).sum();
    let by_rays = row.of(&row.seen, VISIBILITY).map_or(f64::NAN, |images| {
        images.iter().map(|image| 100.0 * (image.redundant.share - image.redundant.half_width)).fold(0.0, f64::max)
    });
    let mut checks = vec![
        Check::new(
            format!("{name}: redundant samples of {PIXEL}"),
            percent(redundant(PIXEL), samples),
            "%",
            Bar::AtMost(0.01),
        ),
        Check::new(
            format!("{name}: redundant samples of {PEELING}"),
            percent(redundant(PEELING), samples),
            "%",
            Bar::AtMost(0.01),
        ),
        Check::new(format!("{name}: redundant samples of {VISIBILITY}, by visibility"), by_rays, "%", Bar::AtMost(0.1)),
    ];
    let useful = row.useful(PIXEL) as f64 / row.useful(PEELING) as f64;
    let title = format!("{name}: useful samples, {PIXEL} over peeling");
    // The paper's own figures of the tree differ from its rule.
    checks.push(match name.as_str() {
        "tree" => Check::not_run(title, "×", Bar::AtLeast(1.0), format!("the paper's exception; {useful:.2} ×")),
        _ => Check::new(title, useful, "×", Bar::AtLeast(1.0)),
    });
    for method in [PIXEL, TOLERANCE] {
        let [ours, whole, peeled] = [method, SamplingMethod::CONVENTIONAL, PEELING].map(|m| row.availability(m));
        let points = |of: fn(&Availability) -> f64| of(&ours) - of(&whole).max(of(&peeled));
        let title =
            |what: &str| format!("{name}: available {what}, {method} over the better of conventional and peeling");
        let bar = Bar::AtLeast(-ROOM_POINTS);
        checks.push(Check::new(title("on average"), points(Availability::mean), "points", bar));
        checks.push(Check::new(title("at least"), points(Availability::least), "points", bar));
    }
    checks
}

/// Samples that are not available, over those of conventional images: 0.64 to 0.75 in the paper's Table 2.
pub(super) fn missing_ratio(rows: &[SceneRow]) -> Check {
    let ratio = |row: &SceneRow| {
        let missing = |method| 100.0 - row.availability(method).mean();
        missing(PIXEL).min(missing(TOLERANCE)) / missing(SamplingMethod::CONVENTIONAL)
    };
    let mean = rows.iter().map(ratio).sum::<f64>() / rows.len() as f64;
    Check::new("not available, non_redundant over conventional, mean of the scenes", mean, "×", Bar::AtMost(0.75))
}
