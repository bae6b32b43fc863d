//! The cost of light, and the gain of sharing it: every lighting with its parts alone, and delivered to a client.

use app_core::experiment::{DeliverySettings, Experiment, PAPER_VIEWS};
use app_core::progress::bar;
use cluster::{Costs, PolicyChoice};
use render::Lighting;
use report::{Bar, Check, Report, Table};

use super::args::BenchArgs;

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
    let qualities = if args.quick { &QUALITIES[..QUICK_QUALITIES] } else { &QUALITIES[..] };
    let progress = bar("light", qualities.len());
    let mut rows = Vec::with_capacity(qualities.len());
    for &name in qualities {
        let views: &[usize] = match (args.quick, name == FINE) {
            (true, _) => &[QUICK_VIEWS],
            (false, true) => &[PAPER_VIEWS, MANY_VIEWS],
            (false, false) => &[PAPER_VIEWS],
        };
        rows.push(row(experiment, name.parse()?, views)?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    report.tables.push(gains(&rows)?);
    report.tables.push(parts(&rows)?);
    report.checks.extend(checks(&rows));
    still(args, experiment, report)
}

fn row(experiment: &Experiment, lighting: Lighting, views: &[usize]) -> anyhow::Result<Row> {
    let settings = |policy, count| DeliverySettings { lighting, ..experiment.delivery(policy, count) };
    let mut pipelines = Vec::with_capacity(views.len());
    let mut costs = Costs::default();
    for &count in views {
        let delivered = experiment.deliver(settings(PolicyChoice::Pipeline, count), drop)?;
        pipelines.push((count, delivered.seconds));
        costs = delivered.plan.costs;
    }
    let direct_views = ((DIRECT_S / costs.direct_view_s) as usize).clamp(4, 48);
    let direct = experiment.deliver(settings(PolicyChoice::Direct, direct_views), drop)?;
    Ok(Row {
        lighting,
        costs,
        images: experiment.setup.samples.len(),
        direct_views,
        direct_view_s: direct.seconds / direct_views as f64,
        pipelines,
    })
}

impl Row {
    /// The pipeline's throughput over that of direct rendering.
    fn gain(&self, views: usize, seconds: f64) -> f64 {
        self.direct_view_s * views as f64 / seconds
    }

    /// The gain that the parts allow: V·g_v / (S·g_s + d + V·c).
    fn allowed(&self, views: usize) -> f64 {
        let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, .. } = self.costs;
        let views = views as f64;
        views * direct_view_s / (self.images as f64 * sample_image_s + load_set_s + views * reconstruct_view_s)
    }
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
    ];
    let mut table = Table::new("What light costs", &columns);
    for row in rows {
        let c = row.costs;
        let seconds = [c.sample_image_s, c.direct_view_s, c.load_set_s, c.reconstruct_view_s, c.encode_view_s];
        let ratio = c.reconstruct_view_s / c.direct_view_s;
        let numbers = seconds.map(|s| s * 1e3).into_iter().chain([ratio]);
        table.push([row.lighting.to_string().into()].into_iter().chain(numbers.map(Into::into)))?;
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
    ];
    let mut table = Table::new("What sharing gains", &columns);
    for row in rows {
        for &(views, seconds) in &row.pipelines {
            table.push([
                row.lighting.to_string().into(),
                views.into(),
                seconds.into(),
                (row.direct_view_s * views as f64).into(),
                row.direct_views.into(),
                row.gain(views, seconds).into(),
                row.allowed(views).into(),
            ])?;
        }
    }
    Ok(table)
}

fn checks(rows: &[Row]) -> Vec<Check> {
    let fine = rows.iter().filter(|row| row.lighting.to_string() == FINE);
    let delivered = fine.flat_map(|row| row.pipelines.iter().map(move |&(views, seconds)| (row, views, seconds)));
    let check = |(row, views, seconds): (&Row, usize, f64)| {
        let name = format!("{FINE}, {views} views: gain over direct, share of what the parts allow");
        Check::new(name, row.gain(views, seconds) / row.allowed(views), "", Bar::AtLeast(SHARE_OF_PARTS))
    };
    delivered.map(check).collect()
}

/// Measures a second set of a still scene: only c and e are spent on it.
fn still(args: &BenchArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let views = if args.quick { QUICK_VIEWS } else { PAPER_VIEWS };
    let settings =
        DeliverySettings { lighting: FINE.parse()?, sets: 2, ..experiment.delivery(PolicyChoice::Pipeline, views) };
    let mut waited_s = 0.0_f64;
    let delivered = experiment.deliver(settings, |frame| {
        if frame.request.set_index == 1 {
            waited_s = waited_s.max(frame.header.stage_times.set_wait_s);
        }
    })?;
    let set_s = experiment.setup.samples.len() as f64 * delivered.plan.costs.sample_image_s;
    let name = "still scene: longest wait of a second frame for its samples, over sampling them";
    report.checks.push(Check::new(name, waited_s / set_s, "", Bar::AtMost(0.01)));
    Ok(())
}
