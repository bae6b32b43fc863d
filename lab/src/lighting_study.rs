//! What light costs, and what sharing it gains: parts measured alone, and views delivered.

use app_core::delivery::Delivered;
use cluster::{Costs, PolicyChoice};
use coordinator::schedule::k_fd;
use render::Lighting;
use study::{Axis, Bar, Check, Point, Report, Series, Table, XyChart};

use crate::experiment::{Experiment, PAPER_VIEWS, Wish};
use crate::progress::bar;

/// The finest lighting of the demo, and the one that promises are about.
pub const FINE: &str = "soft 16, occlusion 16";
/// From the cheapest to the dearest.
const QUALITIES: [&str; 6] = ["unlit", "phong", "shadows", "soft 4, occlusion 4", FINE, "soft 64, occlusion 64"];
/// Direct rendering is timed on as many views as take about this long, and extended linearly.
const DIRECT_S: f64 = 2.0;
/// Of what the parts allow, so much of the gain must arrive at a client.
const SHARE_OF_PARTS: f64 = 0.8;

/// One lighting.
pub struct Row {
    /// Which.
    pub lighting: Lighting,
    /// Each part alone.
    pub costs: Costs,
    /// S and P.
    images: usize,
    nodes: usize,
    /// Views that direct rendering was timed on, and what one of them took until delivered.
    direct_views: usize,
    direct_view_s: f64,
    /// V and seconds until delivered, of sets that nobody had yet.
    pipelines: Vec<(usize, f64)>,
}

/// How much is measured.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    /// Of the qualities, from the cheapest on.
    pub qualities: usize,
    /// V's of the finest promised lighting; the first also of the others.
    pub views: &'static [usize],
}

impl Extent {
    /// Of the demo.
    #[must_use]
    pub fn demo(quick: bool) -> Self {
        if quick { Self { qualities: 4, views: &[64] } } else { Self { qualities: 5, views: &[PAPER_VIEWS] } }
    }

    /// Of the bench.
    #[must_use]
    pub fn bench(quick: bool) -> Self {
        if quick { Self { qualities: 5, views: &[64] } } else { Self { qualities: 6, views: &[PAPER_VIEWS, 1000] } }
    }
}

/// Measures every quality; frames of the last that are delivered for the promised lighting go to `keep`.
///
/// # Errors
/// The cluster's.
pub fn measure(experiment: &Experiment, extent: Extent, mut keep: impl FnMut(Delivered)) -> anyhow::Result<Vec<Row>> {
    let progress = bar("light", extent.qualities);
    let mut rows = Vec::with_capacity(extent.qualities);
    for name in &QUALITIES[..extent.qualities] {
        let views = if *name == FINE { extent.views } else { &extent.views[..1] };
        rows.push(row(experiment, name.parse()?, views, &mut keep)?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(rows)
}

fn row(
    experiment: &Experiment,
    lighting: Lighting,
    views: &[usize],
    keep: &mut impl FnMut(Delivered),
) -> anyhow::Result<Row> {
    let wish = |policy, count| Wish { lighting, ..experiment.wish(policy, count) };
    let mut pipelines = Vec::with_capacity(views.len());
    let mut plan = None;
    for &count in views {
        let delivered = experiment.deliver(wish(PolicyChoice::Pipeline, count), |_| ())?;
        pipelines.push((count, delivered.seconds));
        plan = Some(delivered.plan.clone());
        keep(delivered);
    }
    let plan = plan.ok_or_else(|| anyhow::anyhow!("no views are asked for"))?;
    let direct_views = ((DIRECT_S / plan.costs.direct_view_s) as usize).clamp(4, 48);
    let direct = experiment.deliver(wish(PolicyChoice::Direct, direct_views), |_| ())?;
    Ok(Row {
        lighting,
        costs: plan.costs,
        images: experiment.setup.samples.len(),
        nodes: direct.plan.assignment.compositors.len(),
        direct_views,
        direct_view_s: direct.seconds / direct_views as f64,
        pipelines,
    })
}

impl Row {
    /// Rays that one pixel's finished colour takes.
    fn rays_a_pixel(&self, lamps: usize) -> f64 {
        f64::from(1 + self.lighting.shadow_rays() * lamps as u32 + self.lighting.occlusion_rays())
    }

    /// Throughput over that of direct rendering, for so many views.
    fn gain(&self, (views, seconds): (usize, f64)) -> f64 {
        self.direct_view_s * views as f64 / seconds
    }

    /// What the parts allow: V·g_v / (S·g_s + d + V·c).
    fn allowed(&self, views: usize) -> f64 {
        let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, .. } = self.costs;
        let views = views as f64;
        views * direct_view_s / (self.images as f64 * sample_image_s + load_set_s + views * reconstruct_view_s)
    }

    /// What the parts foretell for so many views.
    fn foretold_s(&self, views: usize) -> f64 {
        let Costs { sample_image_s, reconstruct_view_s, load_set_s, encode_view_s, .. } = self.costs;
        self.images as f64 * sample_image_s + load_set_s + views as f64 * (reconstruct_view_s + encode_view_s)
    }
}

/// Tables and charts.
///
/// # Errors
/// None that can happen: rows and columns are written together.
pub fn report(rows: &[Row], lamps: usize, report: &mut Report) -> anyhow::Result<()> {
    report.tables.push(parts(rows)?);
    report.tables.push(gains(rows)?);
    report.charts.push(ratio_chart(rows, lamps).into());
    report.charts.push(throughput_chart(rows, lamps).into());
    report.charts.push(total_time_chart(rows).into());
    Ok(())
}

fn parts(rows: &[Row]) -> anyhow::Result<Table> {
    let columns = [
        ("lighting", ""),
        ("g_s a sample", "ms"),
        ("g_v a view", "ms"),
        ("d a set", "ms"),
        ("c a view", "ms"),
        ("e a view", "ms"),
        ("c / g_v", ""),
        ("c over unlit", "×"),
        ("K of the formula", ""),
    ];
    let mut table = Table::new("What light costs", &columns);
    let unlit_c = rows.first().map_or(f64::NAN, |row| row.costs.reconstruct_view_s);
    for row in rows {
        let c = row.costs;
        let ms = [c.sample_image_s, c.direct_view_s, c.load_set_s, c.reconstruct_view_s, c.encode_view_s];
        let ratios = [c.reconstruct_view_s / c.direct_view_s, c.reconstruct_view_s / unlit_c];
        let views = row.pipelines.first().map_or(0, |(views, _)| *views);
        let k = k_fd(row.images, c.sample_image_s, views, c.reconstruct_view_s + c.encode_view_s, row.nodes);
        let numbers = ms.map(|s| (s * 1e3).into()).into_iter().chain(ratios.map(Into::into));
        table.push([row.lighting.to_string().into()].into_iter().chain(numbers).chain([k.into()]))?;
    }
    Ok(table)
}

fn gains(rows: &[Row]) -> anyhow::Result<Table> {
    let columns = [
        ("lighting", ""),
        ("views V", ""),
        ("pipeline", "s"),
        ("direct, extended", "s"),
        ("timed on views", ""),
        ("gain", "×"),
        ("its parts allow", "×"),
        ("share of it", "%"),
    ];
    let mut table = Table::new("What sharing gains", &columns);
    for row in rows {
        for &(views, seconds) in &row.pipelines {
            let (gain, allowed) = (row.gain((views, seconds)), row.allowed(views));
            table.push([
                row.lighting.to_string().into(),
                views.into(),
                seconds.into(),
                (row.direct_view_s * views as f64).into(),
                row.direct_views.into(),
                gain.into(),
                allowed.into(),
                (gain / allowed * 100.0).into(),
            ])?;
        }
    }
    Ok(table)
}

fn labelled(row: &Row, x: f64, y: f64) -> Point {
    Point::labelled(x, y, row.lighting.to_string())
}

fn ratio_chart(rows: &[Row], lamps: usize) -> XyChart {
    let points = rows
        .iter()
        .map(|row| labelled(row, row.rays_a_pixel(lamps), row.costs.reconstruct_view_s / row.costs.direct_view_s));
    let mut chart = XyChart::new("c / g against lighting", Axis::log("rays a pixel", ""), Axis::log("c / g_v", ""))
        .with(Series::line("c / g_v", points));
    chart.note = "Reconstructing a view costs the same whatever its light; drawing it does not.".to_owned();
    chart
}

fn throughput_chart(rows: &[Row], lamps: usize) -> XyChart {
    let pipeline = rows.iter().filter_map(|row| {
        let (views, seconds) = row.pipelines.first()?;
        Some(labelled(row, row.rays_a_pixel(lamps), *views as f64 / seconds))
    });
    let direct = rows.iter().map(|row| (row.rays_a_pixel(lamps), row.direct_view_s.recip()));
    let views = rows.first().and_then(|row| row.pipelines.first()).map_or(0, |(views, _)| *views);
    XyChart::new(
        format!("Throughput against lighting, {views} views"),
        Axis::log("rays a pixel", ""),
        Axis::log("delivered", "views/s"),
    )
    .with(Series::line("pipeline", pipeline))
    .with(Series::line("direct", direct))
}

/// V along the axis of the chart.
const VIEWS: [usize; 7] = [1, 3, 10, 32, 100, 290, 1000];

/// Points of a series that only foretells.
const NONE: [Point; 0] = [];

fn total_time_chart(rows: &[Row]) -> XyChart {
    let chart =
        XyChart::new("Total time against views, by lighting", Axis::log("views V", ""), Axis::log("total time", "s"));
    let mut chart = rows.iter().filter(|row| row.lighting != Lighting::PHONG).fold(chart, |chart, row| {
        let direct = VIEWS.map(|views| (views as f64, row.direct_view_s * views as f64));
        let foretold = VIEWS.map(|views| (views as f64, row.foretold_s(views)));
        let measured = row.pipelines.iter().map(|&(views, seconds)| (views as f64, seconds));
        chart
            .with(Series::line(format!("direct, {}", row.lighting), NONE).then_extrapolated(direct))
            .with(Series::line(format!("pipeline, {}", row.lighting), NONE).then_extrapolated(foretold))
            .with(Series::points(format!("pipeline, {}, delivered", row.lighting), measured))
    });
    chart.note = "Dashed: foretold from the parts, S·g_s + d + V·(c + e), or from direct rendering's timed views. Points: delivered to a client.".to_owned();
    chart
}

/// What is promised of the finest lighting.
#[must_use]
pub fn checks(rows: &[Row]) -> Vec<Check> {
    let fine = rows.iter().find(|row| row.lighting.to_string() == FINE);
    let of_parts = fine.iter().flat_map(|row| {
        row.pipelines.iter().map(|&(views, seconds)| {
            let share = row.gain((views, seconds)) / row.allowed(views);
            let name = format!("{FINE}, {views} views: gain over direct, share of what the parts allow");
            Check::new(name, share, "", Bar::AtLeast(SHARE_OF_PARTS))
        })
    });
    of_parts.collect()
}
