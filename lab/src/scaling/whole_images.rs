//! Whole sample images beside tiles: with whole images, no more than S nodes can sample.

use cluster::{Costs, PolicyChoice};
use report::Table;

use super::costs::efficiency;
use super::point::Point;
use super::results::Results;

/// The least T of eq. 2 with whole images, in seconds: max(⌈S/K⌉·g_s, V·(c+e)/(P−K)) at the best K, with no other
/// costs. It is infinite without a node for each role.
#[must_use]
pub fn least_s(costs: &Costs, images: usize, views: usize, nodes: usize) -> f64 {
    let view_s = costs.reconstruct_view_s + costs.encode_view_s;
    let with = |k: usize| {
        let sample_s = images.div_ceil(k) as f64 * costs.sample_image_s;
        sample_s.max(views as f64 * view_s / (nodes - k) as f64)
    };
    (1..nodes).map(with).fold(f64::INFINITY, f64::min)
}

/// The least T of a measured point.
fn bound_s(results: &Results<'_>, point: &Point) -> f64 {
    least_s(&results.lit.mean(point.nodes), results.images, point.settings.views, point.nodes)
}

/// The pipeline's efficiency over the best that whole images allow.
#[must_use]
pub fn over_bound(results: &Results<'_>, nodes: usize, views: usize) -> Option<f64> {
    let point = results.find(PolicyChoice::Pipeline, nodes, views)?;
    Some(bound_s(results, point) / point.period_s)
}

/// The pipeline's speed over that with whole images, both measured.
#[must_use]
pub fn over_whole(results: &Results<'_>, nodes: usize, views: usize) -> Option<f64> {
    let cut = results.find(PolicyChoice::Pipeline, nodes, views)?;
    let same = |point: &&Point| point.settings.whole_images && (point.nodes, point.settings.views) == (nodes, views);
    Some(results.lit.points.iter().find(same)?.period_s / cut.period_s)
}

/// A table of every point whose views are made from samples.
pub fn table(results: &Results<'_>) -> anyhow::Result<Table> {
    let columns = [
        ("P", ""),
        ("V", ""),
        ("asked for", ""),
        ("images", ""),
        ("policy", ""),
        ("K", ""),
        ("tiles of an image", ""),
        ("T", "s"),
        ("efficiency", ""),
        ("whole images allow T", "s"),
        ("whole images allow efficiency", ""),
    ];
    let mut table = Table::new(format!("Whole images and tiles, {}", results.lit.lighting), &columns);
    for point in results.lit.points.iter().filter(|point| point.settings.policy != PolicyChoice::Direct) {
        let (costs, bound_s) = (results.lit.mean(point.nodes), bound_s(results, point));
        table.push([
            point.nodes.into(),
            point.settings.views.into(),
            point.settings.policy.to_string().into(),
            if point.settings.whole_images { "whole" } else { "as the schedule likes" }.into(),
            point.policy().to_string().into(),
            point.samplers().into(),
            point.plan.assignment.tile_count.into(),
            point.period_s.into(),
            results.efficiency(point).into(),
            bound_s.into(),
            efficiency(&costs, results.images, point.settings.views, point.nodes, bound_s).into(),
        ])?;
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_stated_for_the_papers_ratios() {
        let of = |ratio: f64| {
            let costs = Costs { sample_image_s: 1.0, reconstruct_view_s: ratio, ..Costs::default() };
            efficiency(&costs, 4, 1000, 11, least_s(&costs, 4, 1000, 11))
        };
        assert!((of(0.01) - 0.891).abs() < 0.001, "{}", of(0.01));
        assert!((of(0.103) - 0.944).abs() < 0.001, "{}", of(0.103));
        assert!(least_s(&Costs::default(), 4, 10, 1).is_infinite(), "nobody is left to make views");
    }
}
