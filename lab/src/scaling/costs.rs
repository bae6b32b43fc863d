//! Costs of operations on a node with its share of the machine, while the other nodes do the same.

use cluster::{Costs, ROW_PARTS, TileCosts};
use render::Lighting;

use super::processes::NodeProcesses;
use super::subject::{MEASURED_BATCH, Subject};

/// The mean of several measurements; zeros without any.
#[must_use]
pub fn mean(all: &[Costs]) -> Costs {
    let of = |cost: fn(&Costs) -> f64| all.iter().map(cost).sum::<f64>() / all.len().max(1) as f64;
    let shares: Option<Vec<_>> = all.iter().map(|c| c.tiles?.row_shares).collect();
    let mean = |shares: Vec<[f64; ROW_PARTS]>| {
        std::array::from_fn(|part| shares.iter().map(|shares| shares[part]).sum::<f64>() / shares.len().max(1) as f64)
    };
    Costs {
        sample_image_s: of(|c| c.sample_image_s),
        direct_view_s: of(|c| c.direct_view_s),
        reconstruct_view_s: of(|c| c.reconstruct_view_s),
        load_set_s: of(|c| c.load_set_s),
        encode_view_s: of(|c| c.encode_view_s),
        in_order: all.iter().any(|c| c.in_order),
        tiles: TileCosts::of_image(of(|c| c.sample_image_s), of(Costs::tile_overhead_s), shares.map(mean)),
    }
}

/// Costs of all nodes at the same time: a node that is alone on the machine has its caches and memory to itself. The
/// cost of a view depends on its place, so each node has views of its own.
pub async fn measure(
    processes: &NodeProcesses,
    subject: &Subject,
    lighting: Lighting,
    batch: u32,
) -> anyhow::Result<Vec<Costs>> {
    let nodes = processes.nodes();
    let views = subject.views(nodes * MEASURED_BATCH as usize)?;
    let of_node = |node| views.iter().skip(node).step_by(nodes).copied().collect();
    processes.measure((0..nodes).map(|node| subject.measurement(lighting, of_node(node), batch))).await
}

/// (S·g_s + V·(c+e)) / (P·T): the work of one node over the time of P nodes.
#[must_use]
pub fn efficiency(costs: &Costs, images: usize, views: usize, nodes: usize, period_s: f64) -> f64 {
    let view_s = costs.reconstruct_view_s + costs.encode_view_s;
    (images as f64 * costs.sample_image_s + views as f64 * view_s) / (nodes as f64 * period_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_the_papers_equations_5_and_4() {
        let costs = Costs {
            sample_image_s: 1.0,
            direct_view_s: 1.0,
            reconstruct_view_s: 0.1,
            encode_view_s: 0.003,
            ..Costs::default()
        };
        // K = 1 of 11: T = V·c / 10. Eq. 5 over P.
        let period_s = 1000.0 * 0.103 / 10.0;
        let speedup = (4.0 + 103.0) * f64::min(1.0 / 4.0, 10.0 / 103.0);
        assert!((efficiency(&costs, 4, 1000, 11, period_s) - speedup / 11.0).abs() < 1e-12);
        // Eq. 4 over P: naive.
        assert!((efficiency(&costs, 4, 1000, 11, 1000.0 / 11.0) - 0.107).abs() < 1e-12);
        assert_eq!(mean(&[costs, Costs { sample_image_s: 3.0, ..costs }]).sample_image_s, 2.0);
    }
}
