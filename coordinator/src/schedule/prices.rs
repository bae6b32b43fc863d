//! The prices of representations on nodes that share the work evenly.

use cluster::Costs;
use planner::{Price, Pricing, Row, RowCosts};

use super::prediction::time_share_s;
use super::{Load, NodeCosts};

/// A still set serves a viewer for this time, as far as costs are concerned.
pub const STILL_SET_S: f64 = 60.0;

/// Nodes with equal costs, and the work that they share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EqualNodes {
    /// P.
    pub nodes: usize,
    /// View cells, each with sample images of its own.
    pub cells: usize,
    /// V: the views of a sample set.
    pub views_a_set: usize,
    /// g_v; `None` where views may not be drawn directly.
    pub direct_view_s: Option<f64>,
    /// e.
    pub encode_view_s: f64,
}

impl Pricing for EqualNodes {
    fn row(&self, row: &Row, costs: &RowCosts) -> Price {
        let costs = Costs {
            sample_image_s: costs.sample_image_s,
            load_set_s: costs.load_set_s,
            reconstruct_view_s: costs.reconstruct_view_s,
            encode_view_s: self.encode_view_s,
            ..Costs::default()
        };
        let node = NodeCosts { costs, transfer_image_s: None };
        let nodes = self.nodes.max(1);
        let views = self.views_a_set.max(1);
        let images = row.camera_count as usize * self.cells;
        let load = Load { images, cells: self.cells, views, ..Load::default() };
        let set_s = time_share_s(&load, &vec![node; nodes]);
        Price { node_s: set_s * nodes as f64 / views as f64, view_s: node.view_s() }
    }

    fn direct(&self) -> Price {
        let view_s = self.direct_view_s.map_or(f64::INFINITY, |direct_view_s| direct_view_s + self.encode_view_s);
        Price { node_s: view_s, view_s }
    }
}
