//! Views in one light: delivered from shared samples, beside direct drawing.

use anyhow::Context as _;
use app_core::delivery::request;
use app_core::experiment::{Delivered, Experiment};
use cluster::{Costs, OfferSettings, PolicyChoice, SessionPlan, SessionRequest};
use coordinator::schedule::k_fd;
use depth_image::{PinholeCamera, View, ViewPlanes};
use image::imageops;
use metrics::{PictureErrors, flip_map};
use render::Lighting;
use report::{Axis, Picture, PictureRow, Point, Report, Series, Table, XyChart};

use super::contact_sheet::contact_sheet;

/// The time for which direct drawing is timed; the time of more views is extended linearly.
const DIRECT_S: f64 = 2.0;
const DIRECT_VIEWS: std::ops::RangeInclusive<usize> = 4..=48;
/// Deliveries of directly drawn views, of which the fastest counts.
const DIRECT_REPEATS: usize = 3;
/// Rows of pictures in the first light, and in every other one.
const ROWS: [usize; 2] = [6, 2];
const SHEET_COLUMNS: u32 = 20;
/// The numbers of views along the chart's axis.
const CHART_VIEWS: [usize; 7] = [1, 3, 10, 32, 100, 290, 1000];

/// A view beside the same view drawn directly.
struct ComparedView {
    direct: View,
    reconstructed: View,
    /// Over the pixels that show a surface.
    errors: PictureErrors,
}

impl ComparedView {
    fn new(direct: View, reconstructed: View) -> anyhow::Result<Self> {
        let [errors, _] = PictureErrors::of(&direct, &reconstructed)?;
        Ok(Self { direct, reconstructed, errors })
    }
}

/// Measurements and pictures of one light.
pub(super) struct LightResult {
    pub(super) lighting: Lighting,
    plan: SessionPlan,
    /// The number of sample images S.
    images: usize,
    nodes: usize,
    /// All views, in their order.
    views: Vec<View>,
    /// Seconds from the request for all views until the last is decoded, the samples included.
    shared_s: f64,
    direct_view_s: f64,
    /// The views for which direct drawing was timed.
    compared: Vec<ComparedView>,
}

impl LightResult {
    /// Delivers `count` views from samples, and some of them drawn directly.
    ///
    /// # Errors
    /// The cluster fails.
    pub(super) fn measure(experiment: &Experiment, lighting: Lighting, count: usize) -> anyhow::Result<Self> {
        let cameras = experiment.views(count)?;
        let (shared, views) = deliver(experiment, PolicyChoice::Pipeline, lighting, &cameras)?;
        let affordable = (DIRECT_S / shared.plan.costs.direct_view_s) as usize;
        let direct_views = affordable.clamp(*DIRECT_VIEWS.start(), *DIRECT_VIEWS.end()).min(count);
        let step = count / direct_views;
        let timed_cameras: Vec<PinholeCamera> = cameras.iter().copied().step_by(step).take(direct_views).collect();
        let (direct, direct_pictures) = deliver(experiment, PolicyChoice::Direct, lighting, &timed_cameras)?;
        // The first delivery also compiles shaders. Those of reconstruction are compiled when its costs are measured.
        let mut direct_s = direct.seconds;
        for _ in 1..DIRECT_REPEATS {
            let (repeated, _) = deliver(experiment, PolicyChoice::Direct, lighting, &timed_cameras)?;
            direct_s = direct_s.min(repeated.seconds);
        }
        let pairs = direct_pictures.into_iter().zip(views.iter().step_by(step));
        let compared = pairs.map(|(direct, reconstructed)| ComparedView::new(direct, reconstructed.clone()));
        Ok(Self {
            lighting,
            images: experiment.setup.samples.len(),
            nodes: direct.plan.assignment.compositors.len(),
            plan: shared.plan,
            shared_s: shared.seconds,
            direct_view_s: direct_s / direct_views as f64,
            compared: compared.collect::<anyhow::Result<_>>()?,
            views,
        })
    }

    /// The difference between the coordinator's K and the formula's.
    pub(super) fn samplers_off_formula(&self) -> usize {
        self.plan.sampler_count().abs_diff(self.formula_samplers())
    }

    fn formula_samplers(&self) -> usize {
        let Costs { sample_image_s, reconstruct_view_s, encode_view_s, .. } = self.plan.costs;
        let k = k_fd(self.images, sample_image_s, self.views.len(), reconstruct_view_s + encode_view_s, self.nodes);
        k.clamp(1, self.images.max(1))
    }

    /// The time of drawing all views directly over that of making them from samples.
    fn gain(&self) -> f64 {
        self.direct_view_s * self.views.len() as f64 / self.shared_s
    }

    /// Seconds for `views` views from samples, by the costs: S·g_s + d + V·(c + e).
    fn predicted_s(&self, views: usize) -> f64 {
        let Costs { sample_image_s, reconstruct_view_s, load_set_s, encode_view_s, .. } = self.plan.costs;
        self.images as f64 * sample_image_s + load_set_s + views as f64 * (reconstruct_view_s + encode_view_s)
    }

    fn mean_error(&self, value: fn(&PictureErrors) -> f64) -> f64 {
        self.compared.iter().map(|compared| value(&compared.errors)).sum::<f64>() / self.compared.len() as f64
    }

    fn sentence(&self) -> String {
        let lighting = self.lighting;
        let views = self.views.len();
        let shared_s = self.shared_s;
        let direct_s = self.direct_view_s * views as f64;
        format!(
            "{lighting}: {views} views from {} shared samples in {shared_s:.1} s; drawn directly, {direct_s:.1} s ({:.1} times as long).",
            self.images,
            self.gain()
        )
    }
}

/// Views with depth and provenance, in the order of their cameras. All sessions of a light ask for equal views, so that the
/// coordinator measures costs once.
fn deliver(
    experiment: &Experiment,
    policy: PolicyChoice,
    lighting: Lighting,
    cameras: &[PinholeCamera],
) -> anyhow::Result<(Delivered, Vec<View>)> {
    let settings = OfferSettings {
        method: Some(experiment.args.method_in(lighting)),
        lighting: Some(lighting.to_string()),
        ..experiment.setup.offer.settings.clone()
    };
    let request = SessionRequest { planes: ViewPlanes::ALL, ..request(settings, policy, cameras)? };
    let mut frames = Vec::with_capacity(cameras.len());
    let delivered = experiment.receive(request, cameras, |frame| frames.push(frame))?;
    frames.sort_by_key(|frame| frame.request.frame);
    Ok((delivered, frames.into_iter().map(|frame| frame.view).collect()))
}

/// Adds the summary, tables, the chart and the pictures.
///
/// # Errors
/// A view is not of its size.
pub(super) fn report(results: &[LightResult], report: &mut Report) -> anyhow::Result<()> {
    report.summary = results.iter().map(LightResult::sentence).collect::<Vec<_>>().join(" ");
    report.tables.push(gains(results));
    report.tables.push(costs(results));
    report.charts.push(total_time(results));
    for (index, result) in results.iter().enumerate() {
        report.pictures.push(all_views(result));
        let rows = ROWS[index.min(1)];
        for (number, compared) in result.compared.iter().take(rows).enumerate() {
            let title = format!("{}, view {number}", result.lighting);
            report.pictures.push(compared_row(&title, compared)?);
        }
    }
    Ok(())
}

fn gains(results: &[LightResult]) -> Table {
    Table::of_rows(
        "What sharing gains",
        results,
        &[
            ("light", "", |result| result.lighting.to_string().into()),
            ("views V", "", |result| result.views.len().into()),
            ("from samples", "s", |result| result.shared_s.into()),
            ("drawn directly, extended", "s", |result| (result.direct_view_s * result.views.len() as f64).into()),
            ("timed on views", "", |result| result.compared.len().into()),
            ("gain", "×", |result| result.gain().into()),
            ("foreground PSNR", "dB", |result| result.mean_error(|errors| errors.psnr_db).into()),
            ("foreground SSIM", "", |result| result.mean_error(|errors| errors.ssim).into()),
            ("foreground FLIP", "", |result| result.mean_error(|errors| errors.flip).into()),
        ],
    )
}

fn costs(results: &[LightResult]) -> Table {
    Table::of_rows(
        "Costs of one operation, alone and warm",
        results,
        &[
            ("light", "", |result| result.lighting.to_string().into()),
            ("g_s a sample", "ms", |result| (result.plan.costs.sample_image_s * 1e3).into()),
            ("g_v a view", "ms", |result| (result.plan.costs.direct_view_s * 1e3).into()),
            ("d a set", "ms", |result| (result.plan.costs.load_set_s * 1e3).into()),
            ("c a view", "ms", |result| (result.plan.costs.reconstruct_view_s * 1e3).into()),
            ("e a view", "ms", |result| (result.plan.costs.encode_view_s * 1e3).into()),
            ("c / g_v", "", |result| (result.plan.costs.reconstruct_view_s / result.plan.costs.direct_view_s).into()),
            ("samplers K", "", |result| result.plan.sampler_count().into()),
            ("K of the formula", "", |result| result.formula_samplers().into()),
        ],
    )
}

/// Figure 5 of Lages et al.
fn total_time(results: &[LightResult]) -> XyChart {
    const PREDICTED: [Point; 0] = [];
    let mut chart = XyChart::new("Total time against views", Axis::log("views V", ""), Axis::log("total time", "s"));
    for result in results {
        let lighting = result.lighting;
        let direct = CHART_VIEWS.map(|views| (views as f64, result.direct_view_s * views as f64));
        let shared = CHART_VIEWS.map(|views| (views as f64, result.predicted_s(views)));
        let delivered = [(result.views.len() as f64, result.shared_s)];
        chart = chart
            .with(Series::line(format!("direct, {lighting}"), PREDICTED).then_extrapolated(direct))
            .with(Series::line(format!("from samples, {lighting}"), PREDICTED).then_extrapolated(shared))
            .with(Series::points(format!("from samples, {lighting}, delivered"), delivered));
    }
    chart.note = "Dashed: from the costs, S·g_s + d + V·(c + e), and from the timed views of direct drawing. Points: delivered to a client.".to_owned();
    chart
}

fn all_views(result: &LightResult) -> PictureRow {
    let images = result.views.iter().filter_map(pictures::rgb);
    let halved =
        images.map(|image| imageops::thumbnail(&image, (image.width() / 2).max(1), (image.height() / 2).max(1)));
    let images: Vec<_> = halved.collect();
    let name = format!("contact sheet, {}", result.lighting);
    let caption = format!("{} delivered views, {}, at half their size", images.len(), result.lighting);
    let sheet = contact_sheet(&images, SHEET_COLUMNS, 2);
    PictureRow { title: format!("All views, {}", result.lighting), pictures: vec![Picture::new(name, caption, sheet)] }
}

/// The row *direct | reconstructed | error map | provenance*.
fn compared_row(title: &str, compared: &ComparedView) -> anyhow::Result<PictureRow> {
    let ComparedView { direct, reconstructed, .. } = compared;
    let flip = flip_map(direct, reconstructed)?;
    let images = [
        ("direct", pictures::rgb(direct)),
        ("reconstructed", pictures::rgb(reconstructed)),
        ("error map (FLIP, 0 to 1)", Some(pictures::error_map(&flip))),
    ];
    let mut pictures = Vec::with_capacity(4);
    for (what, image) in images {
        let image = image.context("a view is not of its size")?;
        pictures.push(Picture::new(format!("{title} {what}"), what, image));
    }
    if let Some((image, legend)) = pictures::provenance(reconstructed, 0) {
        pictures.push(Picture { legend, ..Picture::new(format!("{title} provenance"), "provenance", image) });
    }
    Ok(PictureRow { title: title.to_owned(), pictures })
}
