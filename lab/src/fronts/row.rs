//! The figures of one row on one subject.

use app_core::planning::Planning;
use depth_image::{PinholeCamera, ViewPlanes};
use metrics::depth_errors;
use planner::{Metric, Price, Pricing, Row, RowCosts, ViewErrors, median_costs};
use probe::{Light, Prober, view_errors};
use rayon::prelude::*;

use crate::evaluation::known_depth;
use crate::statistics::sum_of;

/// Times that rows are timed again.
pub const REPEATS: usize = 2;
/// Views with which rows are timed again.
const TIMED_VIEWS: usize = 16;

/// A measured row.
#[derive(Debug, Clone)]
pub struct MeasuredRow {
    /// The place in the ladder.
    pub place: usize,
    pub row: Row,
    pub costs: RowCosts,
    pub price: Price,
    /// Bytes of an encoded set.
    pub set_bytes: usize,
    /// Of each view.
    pub errors: Vec<ViewErrors>,
    /// Hits off by more than 1 % in depth, of all hits.
    pub wrong_hits: f64,
    /// Pixels that are filled without a sample, of all.
    pub filled: f64,
}

impl MeasuredRow {
    /// Measures a row on views.
    ///
    /// # Errors
    /// The device fails.
    pub fn measure(
        prober: &mut Prober,
        planning: &Planning,
        place: usize,
        cameras: &[PinholeCamera],
        pricing: &impl Pricing,
    ) -> anyhow::Result<Self> {
        let row = &planning.ladder.rows()[place];
        let representation = &planning.representations[place];
        let truths = prober.truths(Light::Session, cameras)?;
        // Delivered views have no depth, and cost less.
        let delivered = prober.subject().planes;
        let costs = prober.measure(representation, Light::Session, cameras, delivered)?.costs;
        let with_depth = ViewPlanes { inverse_depth: true, provenance: true, ..delivered };
        let measured = prober.measure(representation, Light::Session, cameras, with_depth)?;
        let pairs: Vec<_> = cameras.iter().zip(&truths).zip(&measured.views).collect();
        let of_views = pairs.into_par_iter().map(|((camera, truth), made)| {
            let errors = view_errors(camera, truth, made, &measured.sample_images, None)?;
            anyhow::Ok((errors, depth_errors(&known_depth(truth)?, &known_depth(made)?)?))
        });
        let of_views = of_views.collect::<anyhow::Result<Vec<_>>>()?;
        let hits = sum_of(&of_views, |(_, depth)| depth.hit_px);
        let pixels = sum_of(&of_views, |(_, depth)| depth.pixels);
        Ok(Self {
            place,
            row: row.clone(),
            costs,
            price: pricing.row(row, &costs),
            set_bytes: measured.set_bytes,
            errors: of_views.iter().map(|(errors, _)| *errors).collect(),
            wrong_hits: sum_of(&of_views, |(_, depth)| depth.wrong_hit_px) / hits.max(1.0),
            filled: sum_of(&of_views, |(_, depth)| depth.unknown_px) / pixels.max(1.0),
        })
    }

    /// The error in the mean over the foreground of all views.
    pub fn error_ratio(&self, metric: Metric) -> f64 {
        mean_error(&self.errors, metric)
    }

    /// PSNR of the mean squared error over the foreground, in dB; at most that of reports.
    pub fn psnr_db(&self) -> f64 {
        (-10.0 * self.error_ratio(Metric::Psnr).log10()).min(metrics::PSNR_CAP_DB)
    }
}

/// Times rows again, each after all others, and takes the medians: a single timing is off by 10 % and more, and on a cold
/// device by a fifth.
///
/// # Errors
/// The device fails.
pub fn time_again(
    prober: &mut Prober,
    rows: &mut [MeasuredRow],
    planning: &Planning,
    pricing: &impl Pricing,
    mut done: impl FnMut(),
) -> anyhow::Result<()> {
    let cameras = planning.viewpoints.first(TIMED_VIEWS);
    let mut costs: Vec<Vec<RowCosts>> = rows.iter().map(|row| vec![row.costs]).collect();
    for _ in 0..REPEATS {
        for (row, costs) in rows.iter().zip(&mut costs) {
            costs.push(prober.time(&planning.representations[row.place], &cameras)?);
            done();
        }
    }
    for (row, costs) in rows.iter_mut().zip(&costs) {
        row.costs = median_costs(costs);
        row.price = pricing.row(&row.row, &row.costs);
    }
    Ok(())
}

/// The mean error over the pixels that count, of all views.
fn mean_error(errors: &[ViewErrors], metric: Metric) -> f64 {
    let (sum, weight) = errors
        .iter()
        .fold((0.0, 0.0), |(sum, weight), view| (sum + view.excess(metric, 0.0), weight + view.weight(metric)));
    if weight > 0.0 { sum / weight } else { 0.0 }
}
