//! The cost of light, and the gain of sharing it: every lighting with its parts alone, and delivered to a client.

use app_core::experiment::{Experiment, PAPER_VIEWS};
use cluster::{Costs, PolicyChoice};
use render::Lighting;
use report::{Bar, Check, Report};

use super::args::BenchArgs;
use crate::delivery::{DeliverySettings, deliver};
use crate::study::{Column, measure_rows, table};

/// The lighting of the checks.
const FINE: &str = "soft 16, occlusion 16";
/// Lightings, from the cheapest to the most expensive; `--quick` leaves the last out.
const QUALITIES: [&str; 6] = ["unlit", "phong", "shadows", "soft 4, occlusion 4", FINE, "soft 64, occlusion 64"];
const QUICK_QUALITIES: usize = 5;
const QUICK_VIEWS: usize = 64;
/// Views of the second delivery in [`FINE`], beside [`PAPER_VIEWS`].
const MANY_VIEWS: usize = 1000;
/// The time for which direct rendering is timed; more views are extended linearly.
const DIRECT_S: f64 = 2.0;
/// The least share of the gain that the parts allow that must arrive at a client.
const SHARE_OF_PARTS: f64 = 0.8;

/// Measurements of one lighting.
struct Row {
    lighting: Lighting,
    /// Costs of each part alone.
    costs: Costs,
    /// The number of sample images, S.
    images: usize,
    /// The number of views that direct rendering was timed on.
    direct_views: usize,
    direct_view_s: f64,
    /// Numbers of views V and seconds until delivered, of new sets.
    pipelines: Vec<(usize, f64)>,
}

/// Measures every lighting on the scene; adds tables and checks.
pub fn measure(args: &BenchArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let is_quick = args.run.quick;
    let qualities = if is_quick { &QUALITIES[..QUICK_QUALITIES] } else { &QUALITIES[..] };
    let rows = measure_rows("light", qualities, |&name| {
        let views: &[usize] = match (is_quick, name == FINE) {
            (true, _) => &[QUICK_VIEWS],
            (false, true) => &[PAPER_VIEWS, MANY_VIEWS],
            (false, false) => &[PAPER_VIEWS],
        };
        row(experiment, name.parse()?, views)
    })?;
    let gains =
        rows.iter().flat_map(|row| row.pipelines.iter().map(move |&(views, seconds)| Gain { row, views, seconds }));
    let gains: Vec<Gain<'_>> = gains.collect();
    report.tables.push(table("What sharing gains", &gain_columns(), &gains)?);
    report.tables.push(table("What light costs", &PARTS, &rows)?);
    report.checks.extend(checks(&gains));
    still(args, experiment, report)
}

fn row(experiment: &Experiment, lighting: Lighting, views: &[usize]) -> anyhow::Result<Row> {
    let mut pipelines = Vec::with_capacity(views.len());
    let mut costs = Costs::default();
    for &count in views {
        let settings =
            DeliverySettings { lighting, ..DeliverySettings::new(experiment, PolicyChoice::Pipeline, count) };
        let delivered = deliver(experiment, settings, drop)?;
        pipelines.push((count, delivered.seconds));
        costs = delivered.plan.costs;
    }
    let direct_views = ((DIRECT_S / costs.direct_view_s) as usize).clamp(4, 48);
    let settings =
        DeliverySettings { lighting, ..DeliverySettings::new(experiment, PolicyChoice::Direct, direct_views) };
    let direct = deliver(experiment, settings, drop)?;
    Ok(Row {
        lighting,
        costs,
        images: experiment.setup.samples.len(),
        direct_views,
        direct_view_s: direct.seconds / direct_views as f64,
        pipelines,
    })
}

/// The delivery of a number of views.
struct Gain<'r> {
    row: &'r Row,
    views: usize,
    seconds: f64,
}

impl Gain<'_> {
    /// The pipeline's throughput over that of direct rendering.
    fn over_direct(&self) -> f64 {
        self.row.direct_view_s * self.views as f64 / self.seconds
    }

    /// The gain that the parts allow: V·g_v / (S·g_s + d + V·c).
    fn allowed(&self) -> f64 {
        let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, .. } = self.row.costs;
        let views = self.views as f64;
        views * direct_view_s / (self.row.images as f64 * sample_image_s + load_set_s + views * reconstruct_view_s)
    }
}

/// What light costs.
const PARTS: [Column<Row>; 7] = [
    Column::new("lighting", |row| row.lighting.to_string().into()),
    Column::with_unit("g_s a sample", "ms", |row| (row.costs.sample_image_s * 1e3).into()),
    Column::with_unit("g_v a view", "ms", |row| (row.costs.direct_view_s * 1e3).into()),
    Column::with_unit("d a set", "ms", |row| (row.costs.load_set_s * 1e3).into()),
    Column::with_unit("c a view", "ms", |row| (row.costs.reconstruct_view_s * 1e3).into()),
    Column::with_unit("e a view", "ms", |row| (row.costs.encode_view_s * 1e3).into()),
    Column::new("c / g_v", |row| (row.costs.reconstruct_view_s / row.costs.direct_view_s).into()),
];

/// What sharing gains at a number of views.
fn gain_columns<'r>() -> [Column<Gain<'r>>; 7] {
    [
        Column::new("lighting", |gain| gain.row.lighting.to_string().into()),
        Column::new("views V", |gain| gain.views.into()),
        Column::with_unit("pipeline", "s", |gain| gain.seconds.into()),
        Column::with_unit("direct, extended", "s", |gain| (gain.row.direct_view_s * gain.views as f64).into()),
        Column::new("timed on views", |gain| gain.row.direct_views.into()),
        Column::with_unit("gain", "×", |gain| gain.over_direct().into()),
        Column::with_unit("its parts allow", "×", |gain| gain.allowed().into()),
    ]
}

fn checks(gains: &[Gain<'_>]) -> Vec<Check> {
    let fine = gains.iter().filter(|gain| gain.row.lighting.to_string() == FINE);
    fine.map(|gain| {
        let name = format!("{FINE}, {} views: gain over direct, share of what the parts allow", gain.views);
        Check::new(name, gain.over_direct() / gain.allowed(), "", Bar::AtLeast(SHARE_OF_PARTS))
    })
    .collect()
}

/// Measures a second set of a still scene: only c and e are spent on it.
fn still(args: &BenchArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let views = if args.run.quick { QUICK_VIEWS } else { PAPER_VIEWS };
    let settings = DeliverySettings {
        lighting: FINE.parse()?,
        sets: 2,
        ..DeliverySettings::new(experiment, PolicyChoice::Pipeline, views)
    };
    let mut waited_s = 0.0_f64;
    let delivered = deliver(experiment, settings, |frame| {
        if frame.request.set_index == 1 {
            waited_s = waited_s.max(frame.header.stage_times.set_wait_s);
        }
    })?;
    let set_s = experiment.setup.samples.len() as f64 * delivered.plan.costs.sample_image_s;
    let name = "still scene: longest wait of a second frame for its samples, over sampling them";
    report.checks.push(Check::new(name, waited_s / set_s, "", Bar::AtMost(0.01)));
    Ok(())
}
