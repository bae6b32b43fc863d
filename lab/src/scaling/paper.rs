//! Figures of Lages et al., §5: eleven PCs, each with a GeForce 7900 GTX, over Gigabit Ethernet.

/// One row of Table 1: V = 1000, K = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperRow {
    pub nodes: usize,
    /// Efficiency of the proposed architecture.
    pub proposed: f64,
    /// Efficiency of views distributed to renderers.
    pub naive: f64,
}

const fn row(nodes: usize, proposed: f64, naive: f64) -> PaperRow {
    PaperRow { nodes, proposed, naive }
}

/// Table 1.
pub const TABLE_1: [PaperRow; 7] = [
    row(5, 0.715, 0.103),
    row(6, 0.757, 0.105),
    row(7, 0.792, 0.106),
    row(8, 0.812, 0.108),
    row(9, 0.818, 0.108),
    row(10, 0.826, 0.110),
    row(11, 0.829, 0.110),
];

/// "Our system rendered 290 views in 2.61 seconds … with 5 GPUs."
pub const HEADLINE_S: f64 = 2.61;

/// The row of a number of nodes.
pub fn table_1(nodes: usize) -> Option<&'static PaperRow> {
    TABLE_1.iter().find(|row| row.nodes == nodes)
}
