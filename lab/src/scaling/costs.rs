//! Costs of operations on a node with its share of the machine, while the other nodes do the same.

use cluster::{Costs, ROW_PARTS, TileCosts};
use simulation::Calls;

use super::nodes::Nodes;
use super::subject::{MEASURED_BATCH, Subject};

/// Costs that P nodes timed at the same time, each with its quota, before and after the points.
#[derive(Debug, Clone, Default)]
pub struct Timed {
    pub nodes: usize,
    pub quota_cores: f64,
    /// Costs of every node, once for each request.
    pub costs: Vec<Costs>,
    /// Costs with one view a call; without them calls are taken to cost nothing.
    pub alone: Vec<Costs>,
}

impl Timed {
    /// The mean over all nodes and times.
    pub fn mean(&self) -> Costs {
        mean(&self.costs)
    }

    /// Costs of a view, and of a call to the device: both follow from calls of one view and of many.
    pub fn by_view_and_call(&self) -> (Costs, Calls) {
        let costs = self.mean();
        let alone = if self.alone.is_empty() { costs } else { mean(&self.alone) };
        let [reconstruct_view_s, reconstruct_s] = view_and_call_s(alone.reconstruct_view_s, costs.reconstruct_view_s);
        let [direct_view_s, direct_s] = view_and_call_s(alone.direct_view_s, costs.direct_view_s);
        (Costs { reconstruct_view_s, direct_view_s, ..costs }, Calls { reconstruct_s, direct_s })
    }
}

/// The time of a view and of a call, from that of one view alone and that of a view among many.
fn view_and_call_s(alone_s: f64, of_many_s: f64) -> [f64; 2] {
    let many = f64::from(MEASURED_BATCH);
    let view_s = ((many * of_many_s - alone_s) / (many - 1.0)).clamp(0.0, of_many_s);
    [view_s, ((of_many_s - view_s) * many).max(0.0)]
}

/// The mean of several measurements; zeros without any.
pub fn mean(all: &[Costs]) -> Costs {
    let of = |cost: fn(&Costs) -> f64| all.iter().map(cost).sum::<f64>() / all.len().max(1) as f64;
    let shares: Option<Vec<[f64; ROW_PARTS]>> = all.iter().map(|c| c.tiles?.row_shares).collect();
    let row_shares: Option<[f64; ROW_PARTS]> = shares.map(|shares| {
        std::array::from_fn(|part| shares.iter().map(|shares| shares[part]).sum::<f64>() / shares.len().max(1) as f64)
    });
    Costs {
        sample_image_s: of(|c| c.sample_image_s),
        direct_view_s: of(|c| c.direct_view_s),
        reconstruct_view_s: of(|c| c.reconstruct_view_s),
        load_set_s: of(|c| c.load_set_s),
        encode_view_s: of(|c| c.encode_view_s),
        in_order: all.iter().any(|c| c.in_order),
        tiles: TileCosts::of_image(of(|c| c.sample_image_s), of(Costs::tile_overhead_s), row_shares),
    }
}

/// Costs of all nodes at the same time: a node that is alone on the machine has its caches and memory to itself. The
/// cost of a view depends on its place, so each node has views of its own.
pub async fn measure(nodes: &Nodes, subject: &Subject, batch: u32) -> anyhow::Result<Vec<Costs>> {
    let count = nodes.count();
    let views = subject.views(count * MEASURED_BATCH as usize)?;
    let requests = (0..count).map(|node| {
        let own_views = views.iter().skip(node).step_by(count).copied().collect();
        subject.measurement(subject.set(), own_views, batch)
    });
    nodes.measure(requests.collect::<anyhow::Result<Vec<_>>>()?).await
}

/// (S·g_s + V·(c+e)) / (P·T): the work of one node over the time of P nodes.
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

    #[test]
    fn costs_of_calls_and_views_are_separated() {
        // 10 ms a call and 2 ms a view, drawn directly at 5 ms a view and nothing a call.
        let many = f64::from(MEASURED_BATCH);
        let of_many = Costs { reconstruct_view_s: 0.01 / many + 0.002, direct_view_s: 0.005, ..Costs::default() };
        let alone = Costs { reconstruct_view_s: 0.012, direct_view_s: 0.005, ..Costs::default() };
        let timed = Timed { nodes: 1, quota_cores: 1.0, costs: vec![of_many], alone: vec![alone] };
        let (costs, calls) = timed.by_view_and_call();
        assert!((costs.reconstruct_view_s - 0.002).abs() < 1e-12 && (calls.reconstruct_s - 0.01).abs() < 1e-12);
        assert!((costs.direct_view_s - 0.005).abs() < 1e-12 && calls.direct_s.abs() < 1e-12);
    }
}
