//! Figures of the paper, Tables 1 and 2.

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

/// The paper's figures of an image, in per cent; `None` where it has none.
#[derive(Debug, Clone, Copy, Default)]
pub struct PaperImage {
    pub redundant: Option<f64>,
    pub disoccluded: Option<f64>,
    pub useful: Option<f64>,
}

/// The paper's redundant, disoccluded and useful samples of an image.
pub(super) fn paper_image(scene: &str, method: SamplingMethod, image: usize) -> PaperImage {
    let Some(PaperRow { redundant, apart, peeled, .. }) = PAPER.iter().find(|row| row.scene == scene) else {
        return PaperImage::default();
    };
    let later = image.checked_sub(1);
    let pair = match method {
        SamplingMethod::Conventional(_) => {
            let redundant = later.map_or(Some(0.0), |later| redundant.get(later).copied());
            return PaperImage { redundant, disoccluded: Some(0.0), useful: None };
        }
        SamplingMethod::DepthPeeling { .. } => peeled.get(image),
        _ => later.and_then(|later| apart.get(later)),
    };
    PaperImage { redundant: Some(0.0), disoccluded: pair.map(|pair| pair[0]), useful: pair.map(|pair| pair[1]) }
}

/// The paper's average and least availability of a set.
pub(super) fn paper_available(scene: &str, method: SamplingMethod) -> [Option<f64>; 2] {
    let kind = match method {
        SamplingMethod::Conventional(_) => 0,
        SamplingMethod::DepthPeeling { .. } => 2,
        _ => 1,
    };
    let figures = PAPER_AVAILABLE.iter().find(|(name, _)| *name == scene).map(|(_, figures)| figures[kind]);
    [0, 1].map(|place| figures.map(|figures| figures[place]))
}

/// Xie, Table 2: average and least of conventional, non-redundant and peeled images.
const PAPER_AVAILABLE: [(&str, [[f64; 2]; 3]); 4] = [
    ("bird-nest", [[90.0, 89.0], [93.0, 92.0], [92.0, 89.0]]),
    ("grass", [[86.0, 81.0], [96.0, 91.0], [93.0, 88.0]]),
    ("urban", [[97.0, 96.0], [98.0, 97.0], [96.0, 91.0]]),
    ("tree", [[55.0, 53.0], [59.0, 57.0], [55.0, 48.0]]),
];
