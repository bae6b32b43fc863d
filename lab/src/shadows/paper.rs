//! Figures of the paper: Tables 3, 4 and 5, and the captions of Figs 1 and 8.

/// i and v of a sampling.
pub type Pair = [f64; 2];

/// A row of Table 3 or 4: non-redundant, conventional and peeled images.
#[derive(Debug, Clone, Copy)]
pub struct PaperRow {
    pub scene: &'static str,
    /// The side of images in pixels (Table 3), or the lamp's size (Table 4).
    pub at: f32,
    pub non_redundant: Pair,
    pub conventional: Pair,
    pub peeled: Pair,
}

const fn row(scene: &'static str, at: f32, non_redundant: Pair, conventional: Pair, peeled: Pair) -> PaperRow {
    PaperRow { scene, at, non_redundant, conventional, peeled }
}

pub const TABLE_3: [PaperRow; 6] = [
    row("grass", 512.0, [3.20, 7.21], [7.98, 9.62], [4.57, 8.34]),
    row("grass", 1024.0, [1.71, 3.70], [5.15, 6.12], [2.55, 4.41]),
    row("grass", 1536.0, [1.26, 2.55], [4.24, 4.94], [1.84, 3.02]),
    row("urban", 512.0, [3.54, 4.74], [7.40, 7.80], [15.85, 18.52]),
    row("urban", 1024.0, [1.60, 2.07], [3.46, 3.64], [11.36, 12.62]),
    row("urban", 1536.0, [1.10, 1.36], [2.28, 2.39], [9.97, 10.77]),
];

pub const TABLE_4: [PaperRow; 10] = [
    row("grass", 0.25, [1.53, 3.057], [3.57, 4.16], [2.53, 4.22]),
    row("grass", 0.5, [1.62, 3.40], [4.24, 4.88], [2.54, 4.31]),
    row("grass", 1.0, [1.71, 3.70], [5.15, 6.12], [2.55, 4.41]),
    row("grass", 2.0, [1.88, 3.97], [5.55, 6.92], [2.79, 4.68]),
    row("grass", 4.0, [2.83, 4.98], [5.95, 7.86], [3.59, 5.40]),
    row("urban", 0.25, [2.38, 3.39], [4.94, 5.13], [3.95, 5.89]),
    row("urban", 0.5, [2.06, 2.86], [3.81, 4.01], [5.98, 7.50]),
    row("urban", 1.0, [1.60, 2.07], [3.46, 3.64], [11.36, 12.62]),
    row("urban", 2.0, [1.07, 1.38], [2.67, 3.01], [19.91, 21.27]),
    row("urban", 4.0, [1.95, 2.30], [6.77, 7.35], [29.64, 31.11]),
];

/// Table 5, in milliseconds: images and quads, then all shadow maps; non-redundant, conventional and peeled images.
pub const TABLE_5: [(&str, [[f64; 2]; 3]); 4] = [
    ("bird-nest", [[58.9, 710.0], [92.2, 771.0], [48.1, 490.0]]),
    ("grass", [[92.8, 735.0], [119.2, 926.0], [87.1, 642.0]]),
    ("urban", [[116.4, 802.0], [133.1, 976.0], [101.6, 541.0]]),
    ("tree", [[75.2, 807.0], [99.2, 954.0], [65.6, 628.0]]),
];
