//! Figures of the paper, Tables 1 and 2.

use report::Cell;
use sampling::SamplingMethod;

/// Xie, Table 1, in the order of [`super::SCENES`].
const PAPER: [PaperRow; 4] = [
    PaperRow {
        scene: "bird-nest",
        redundant: [70.0, 80.0],
        apart: [[62.0, 89.0], [76.0, 86.0]],
        peeled: [[10.0, 99.0], [46.0, 2.0], [52.0, 71.0]],
    },
    PaperRow {
        scene: "grass",
        redundant: [54.0, 69.0],
        apart: [[56.0, 85.0], [75.0, 80.0]],
        peeled: [[15.0, 99.0], [51.0, 4.0], [71.0, 79.0]],
    },
    PaperRow {
        scene: "urban",
        redundant: [82.0, 84.0],
        apart: [[73.0, 40.0], [80.0, 23.0]],
        peeled: [[1.0, 100.0], [78.0, 7.0], [88.0, 8.0]],
    },
    PaperRow {
        scene: "tree",
        redundant: [23.0, 35.0],
        apart: [[84.0, 99.0], [88.0, 98.0]],
        peeled: [[44.0, 99.0], [63.0, 98.0], [72.0, 97.0]],
    },
];

/// A row in per cent; pairs are disoccluded and useful.
struct PaperRow {
    scene: &'static str,
    /// Redundant samples of conventional images 1 and 2.
    redundant: [f64; 2],
    /// Disoccluded and useful samples of non-redundant images 1 and 2.
    apart: [[f64; 2]; 2],
    /// Disoccluded and useful samples of layers 0 to 2.
    peeled: [[f64; 2]; 3],
}

/// The paper's redundant, disoccluded and useful samples of an image, in per cent.
pub(super) fn paper(scene: &str, method: SamplingMethod, image: usize) -> [Cell; 3] {
    let nothing = || Cell::from(f64::NAN);
    let Some(PaperRow { redundant, apart, peeled, .. }) = PAPER.iter().find(|row| row.scene == scene) else {
        return [nothing(), nothing(), nothing()];
    };
    let pair = |pair: Option<&[f64; 2]>| pair.map_or([f64::NAN; 2], |pair| *pair);
    let [disoccluded, useful] = match method {
        SamplingMethod::Conventional(_) => [0.0, f64::NAN],
        SamplingMethod::DepthPeeling { .. } => pair(peeled.get(image)),
        _ => pair(image.checked_sub(1).and_then(|i| apart.get(i))),
    };
    let redundant = match (method, image) {
        (SamplingMethod::Conventional(_), 1..) => redundant.get(image - 1).copied().unwrap_or(f64::NAN),
        _ => 0.0,
    };
    [redundant, disoccluded, useful].map(Cell::from)
}

/// Xie, Table 2: average and least of conventional, non-redundant and peeled images.
pub(super) const PAPER_AVAILABLE: [(&str, [[f64; 2]; 3]); 4] = [
    ("bird-nest", [[90.0, 89.0], [93.0, 92.0], [92.0, 89.0]]),
    ("grass", [[86.0, 81.0], [96.0, 91.0], [93.0, 88.0]]),
    ("urban", [[97.0, 96.0], [98.0, 97.0], [96.0, 91.0]]),
    ("tree", [[55.0, 53.0], [59.0, 57.0], [55.0, 48.0]]),
];
