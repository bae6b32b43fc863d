//! The figures of one row on one subject.

use std::sync::Arc;

use anyhow::Context as _;
use depth_image::{DepthImage, PinholeCamera, View, ViewPlanes};
use metrics::{DepthErrors, PixelClass, Rgb8Image, classify, depth_errors, flip_map, foreground, ssim_map};
use planner::{Ladder, Metric, Price, Pricing, Row, RowCosts, ViewErrors, median_costs};
use probe::{Light, Prober, Representation, view_errors};
use rayon::prelude::*;

use crate::evaluation::known_depth;

/// The side of sample images that `--sample-size auto` chooses.
const DEFAULT_SIDE_RATIO: f64 = 1.0;

/// The classes of pixels by which errors are split.
pub const CLASSES: [(PixelClass, &str); 3] = [
    (PixelClass::Covered, "FLIP, covered"),
    (PixelClass::Disoccluded, "FLIP, disoccluded"),
    (PixelClass::Silhouette, "FLIP, silhouettes"),
];

/// Times that rows are timed again.
pub const REPEATS: usize = 2;
/// Views with which rows are timed again.
pub const TIMED_VIEWS: usize = 16;

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
    /// Texels of a set that hold a sample.
    pub samples: usize,
    /// Of each view.
    pub errors: Vec<ViewErrors>,
    /// FLIP of the pixels of each class, over all views; `None` where there are none.
    pub class_flips: [Option<f64>; CLASSES.len()],
    /// SSIM of the foreground, over the views that have one; `None` where none has.
    pub ssim: Option<f64>,
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
        (place, row): (usize, &Row),
        representation: &Representation,
        cameras: &[PinholeCamera],
        pricing: &impl Pricing,
    ) -> anyhow::Result<Self> {
        let truths = prober.truths(Light::Session, cameras)?;
        // Delivered views have no depth, and cost less.
        let delivered = prober.subject().planes;
        let costs = prober.measure(representation, Light::Session, cameras, delivered)?.costs;
        let with_depth = ViewPlanes { inverse_depth: true, provenance: true, ..delivered };
        let measured = prober.measure(representation, Light::Session, cameras, with_depth)?;
        let pairs: Vec<_> = cameras.iter().zip(&truths).zip(&measured.views).collect();
        let of_view = |((camera, truth), made): ((&PinholeCamera, &Arc<View>), &View)| {
            let errors = view_errors(camera, truth, made, &measured.sample_images)?;
            let depth = depth_errors(&known_depth(truth)?, &known_depth(made)?, None)?;
            let pictures = PictureSums::of(camera, truth, made, &measured.sample_images)?;
            anyhow::Ok((errors, depth, pictures))
        };
        let of_views = pairs.into_par_iter().map(of_view).collect::<anyhow::Result<Vec<_>>>()?;
        let sum = |of: fn(&DepthErrors) -> usize| of_views.iter().map(|(_, depth, _)| of(depth)).sum::<usize>() as f64;
        let ssims: Vec<f64> = of_views.iter().filter_map(|(.., pictures)| pictures.ssim).collect();
        let class_flip = |class: usize| {
            let sums = of_views.iter().map(|(.., pictures)| pictures.class_flips[class]);
            let (sum, pixels) = sums.fold((0.0, 0), |(sum, all), (own, pixels)| (sum + own, all + pixels));
            (pixels > 0).then(|| sum / pixels as f64)
        };
        let depths = measured.sample_images.iter().flat_map(|image| &image.inverse_depth_per_m);
        Ok(Self {
            place,
            row: row.clone(),
            costs,
            price: pricing.row(row, &costs),
            set_bytes: measured.set_bytes,
            samples: depths.filter(|&&inverse| inverse > 0.0).count(),
            errors: of_views.iter().map(|(errors, ..)| *errors).collect(),
            class_flips: std::array::from_fn(class_flip),
            ssim: (!ssims.is_empty()).then(|| ssims.iter().sum::<f64>() / ssims.len() as f64),
            wrong_hits: sum(|depth| depth.wrong_hit_px) / sum(|depth| depth.hit_px).max(1.0),
            filled: sum(|depth| depth.unknown_px) / sum(|depth| depth.pixels).max(1.0),
        })
    }

    /// The error in the mean over the foreground of all views.
    #[must_use]
    pub fn error_ratio(&self, metric: Metric) -> f64 {
        mean_error(&self.errors, metric)
    }

    /// PSNR of the mean squared error over the foreground, in dB; at most that of reports.
    #[must_use]
    pub fn psnr_db(&self) -> f64 {
        (-10.0 * self.error_ratio(Metric::Psnr).log10()).min(metrics::PSNR_CAP_DB)
    }
}

/// Errors of one view, to be added up.
#[derive(Debug, Clone, Copy)]
struct PictureSums {
    /// The sum of FLIP over the pixels of each class, and their number.
    class_flips: [(f64, usize); CLASSES.len()],
    /// The mean over the foreground, if there is any.
    ssim: Option<f64>,
}

impl PictureSums {
    fn of(camera: &PinholeCamera, truth: &View, made: &View, images: &[DepthImage]) -> anyhow::Result<Self> {
        let (expected, actual) = (Rgb8Image::of_view(truth)?, Rgb8Image::of_view(made)?);
        let depth = truth.inverse_depth_per_m.as_deref().context("a reference without depth")?;
        let (classes, flip) = (classify(camera, depth, images)?, flip_map(&expected, &actual)?);
        let sums = |(class, _): (PixelClass, &str)| {
            let own = flip.values.iter().zip(&classes).filter(|(_, of)| **of == class);
            own.fold((0.0, 0), |(sum, pixels), (value, _)| (sum + f64::from(*value), pixels + 1))
        };
        let ssim = ssim_map(&expected, &actual)?.mean(Some(&foreground(truth, &actual)?))?;
        Ok(Self { class_flips: CLASSES.map(sums), ssim })
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
    (representations, cameras): (&[Representation], &[PinholeCamera]),
    pricing: &impl Pricing,
    mut done: impl FnMut(),
) -> anyhow::Result<()> {
    let mut costs: Vec<Vec<RowCosts>> = rows.iter().map(|row| vec![row.costs]).collect();
    for _ in 0..REPEATS {
        for (row, costs) in rows.iter().zip(&mut costs) {
            costs.push(prober.time(&representations[row.place], cameras)?);
            done();
        }
    }
    for (row, costs) in rows.iter_mut().zip(&costs) {
        row.costs = median_costs(costs);
        row.price = pricing.row(&row.row, &row.costs);
    }
    Ok(())
}

/// The place of the row with the default methods, the largest images and this number of cameras.
///
/// # Errors
/// The ladder lacks it.
pub fn default_place(ladder: &Ladder, camera_count: u32) -> anyhow::Result<usize> {
    let is_default = |row: &Row| {
        row.sampling == sampling::METHODS[0].name
            && row.method == reconstruction::METHODS[0].name
            && (row.side_ratio, row.camera_count) == (DEFAULT_SIDE_RATIO, camera_count)
    };
    ladder.rows().iter().position(is_default).context("the ladder lacks the default row")
}

/// The mean error over the pixels that count, of all views.
#[must_use]
pub fn mean_error(errors: &[ViewErrors], metric: Metric) -> f64 {
    let (sum, weight) = errors
        .iter()
        .fold((0.0, 0.0), |(sum, weight), view| (sum + view.excess(metric, 0.0), weight + view.weight(metric)));
    if weight > 0.0 { sum / weight } else { 0.0 }
}
