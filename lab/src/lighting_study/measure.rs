//! Measurements of lightings: parts alone, and views delivered.

use app_core::experiment::{DeliverySettings, Experiment, PAPER_VIEWS};
use app_core::progress::bar;
use cluster::{Costs, PolicyChoice};
use render::Lighting;

/// The lighting which the checks are about.
pub const FINE: &str = "soft 16, occlusion 16";
/// Lightings, from the cheapest to the most expensive.
const QUALITIES: [&str; 6] = ["unlit", "phong", "shadows", "soft 4, occlusion 4", FINE, "soft 64, occlusion 64"];
/// The time for which direct rendering is timed; more views are extended linearly.
const DIRECT_S: f64 = 2.0;

/// Measurements of one lighting.
pub struct Row {
    pub lighting: Lighting,
    /// Costs of each part alone.
    pub costs: Costs,
    /// The numbers of sample images S and nodes P.
    pub(super) images: usize,
    pub(super) nodes: usize,
    /// The number of views that direct rendering was timed on, and seconds a view until delivered.
    pub(super) direct_views: usize,
    pub(super) direct_view_s: f64,
    /// Numbers of views V and seconds until delivered, of new sets.
    pub(super) pipelines: Vec<(usize, f64)>,
}

/// The size of the study.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    /// The number of lightings, from the cheapest on.
    pub qualities: usize,
    /// Numbers of views V of the finest lighting; other lightings have the first.
    pub views: &'static [usize],
}

impl Extent {
    /// The size in the bench.
    #[must_use]
    pub fn bench(quick: bool) -> Self {
        if quick { Self { qualities: 5, views: &[64] } } else { Self { qualities: 6, views: &[PAPER_VIEWS, 1000] } }
    }
}

/// Measures every lighting.
///
/// # Errors
/// The cluster fails.
pub fn measure(experiment: &Experiment, extent: Extent) -> anyhow::Result<Vec<Row>> {
    let progress = bar("light", extent.qualities);
    let mut rows = Vec::with_capacity(extent.qualities);
    for name in &QUALITIES[..extent.qualities] {
        let views = if *name == FINE { extent.views } else { &extent.views[..1] };
        rows.push(row(experiment, name.parse()?, views)?);
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(rows)
}

fn row(experiment: &Experiment, lighting: Lighting, views: &[usize]) -> anyhow::Result<Row> {
    let settings = |policy, count| DeliverySettings { lighting, ..experiment.delivery(policy, count) };
    let mut pipelines = Vec::with_capacity(views.len());
    let mut plan = None;
    for &count in views {
        let delivered = experiment.deliver(settings(PolicyChoice::Pipeline, count), drop)?;
        pipelines.push((count, delivered.seconds));
        plan = Some(delivered.plan);
    }
    let plan = plan.ok_or_else(|| anyhow::anyhow!("no views are asked for"))?;
    let direct_views = ((DIRECT_S / plan.costs.direct_view_s) as usize).clamp(4, 48);
    let direct = experiment.deliver(settings(PolicyChoice::Direct, direct_views), drop)?;
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
    /// Rays for the finished colour of one pixel.
    pub(super) fn rays_a_pixel(&self, lamps: usize) -> f64 {
        f64::from(1 + self.lighting.shadow_rays() * lamps as u32 + self.lighting.ambient_rays())
    }

    /// The pipeline's throughput over direct rendering's.
    pub(super) fn gain(&self, (views, seconds): (usize, f64)) -> f64 {
        self.direct_view_s * views as f64 / seconds
    }

    /// The gain that the parts allow: V·g_v / (S·g_s + d + V·c).
    pub(super) fn allowed(&self, views: usize) -> f64 {
        let Costs { sample_image_s, direct_view_s, reconstruct_view_s, load_set_s, .. } = self.costs;
        let views = views as f64;
        views * direct_view_s / (self.images as f64 * sample_image_s + load_set_s + views * reconstruct_view_s)
    }

    /// Seconds for `views` views, predicted from the parts.
    pub(super) fn predicted_s(&self, views: usize) -> f64 {
        let Costs { sample_image_s, reconstruct_view_s, load_set_s, encode_view_s, .. } = self.costs;
        self.images as f64 * sample_image_s + load_set_s + views as f64 * (reconstruct_view_s + encode_view_s)
    }
}
