//! The ways to make views among which a budget chooses, and their prices.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::invalid::{InvalidField, name, within};

/// The most rows of a plan.
pub const MAX_ROWS: usize = 49;
/// The most sample cameras of a row, in one view cell.
const MAX_CAMERAS: u32 = 9;
/// The error with twice the cameras, density or rays, over that without: what these bring in most scenes.
const ERROR_OF_DOUBLING: [f64; 3] = [0.85, 0.75, 0.75];
/// More seconds than any cost has.
const MOST_SECONDS: f64 = 1e6;

/// One way to make views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Row {
    /// Views from sample images.
    Samples {
        /// The method of reconstruction, as users name it.
        method: String,
        /// S, in each view cell.
        camera_count: u32,
        /// Texels of a sample image for a pixel of a view, each way.
        density: f64,
    },
    /// Views drawn from the scene.
    Direct {
        /// The lighting of the session, with all of its rays or fewer.
        lighting: String,
        /// The share of the rays, at most 1.
        ray_ratio: f64,
    },
}

impl Row {
    /// # Errors
    /// For a value that its field does not allow.
    pub fn validate(&self) -> Result<(), InvalidField> {
        match self {
            Self::Samples { method, camera_count, density } => {
                name(method, "method")?;
                within(*camera_count, 1..=MAX_CAMERAS, "camera_count", "from 1 to 9")?;
                within(*density, 0.01..=16.0, "density", "from 0.01 to 16")
            }
            Self::Direct { lighting, ray_ratio } => {
                name(lighting, "lighting")?;
                within(*ray_ratio, 0.001..=1.0, "ray_ratio", "from 0.001 to 1")
            }
        }
    }

    /// By how many doublings of cameras, density and rays the row is above another of its method; `None` for another method.
    pub(crate) fn doublings_from(&self, other: &Self) -> Option<[f64; 3]> {
        match (self, other) {
            (
                Self::Samples { method, camera_count, density },
                Self::Samples { method: other_method, camera_count: other_count, density: other_density },
            ) if method == other_method => {
                let cameras = f64::from(*camera_count) / f64::from(*other_count);
                Some([cameras.log2(), (density / other_density).log2(), 0.0])
            }
            (Self::Direct { ray_ratio, .. }, Self::Direct { ray_ratio: other, .. }) => {
                Some([0.0, 0.0, (ray_ratio / other).log2()])
            }
            _ => None,
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Samples { method, camera_count, density } => {
                write!(f, "{method}, S = {camera_count}, density {density}")
            }
            Self::Direct { lighting, .. } => write!(f, "direct drawing, {lighting}"),
        }
    }
}

/// Measured costs of a row, in s.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RowCosts {
    /// g_s: sampling, lighting and encoding an image.
    pub sample_image_s: f64,
    /// d: loading the set of a view cell.
    pub load_set_s: f64,
    /// A view, without encoding, which costs the same in all rows.
    pub view_s: f64,
}

impl RowCosts {
    /// The costs of a row that is so many [doublings](Row::doublings_from) above: images have more texels, and views take about as
    /// long.
    pub(crate) fn after(&self, [cameras, density, _]: [f64; 3]) -> Self {
        let texels = 4_f64.powf(density);
        Self {
            sample_image_s: self.sample_image_s * texels,
            load_set_s: self.load_set_s * texels * cameras.exp2(),
            view_s: self.view_s,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), InvalidField> {
        let fields =
            [(self.sample_image_s, "sample_image_s"), (self.load_set_s, "load_set_s"), (self.view_s, "view_s")];
        fields.into_iter().try_for_each(|(value, field)| within(value, 0.0..=MOST_SECONDS, field, "from 0 to 10^6"))
    }
}

/// The work that views are part of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// P: the nodes that share the work evenly.
    pub nodes: usize,
    /// View cells, each with sample images of its own.
    pub cells: usize,
    /// V: the views that share a sample set.
    pub views_a_set: usize,
}

impl Demand {
    /// The nodes' time for a view, in s: its part of the set, which every node loads, and the view itself.
    #[must_use]
    pub fn price_s(&self, row: &Row, costs: &RowCosts) -> f64 {
        let Row::Samples { camera_count, .. } = row else { return costs.view_s };
        let cells = self.cells.max(1) as f64;
        let sampled_s = cells * f64::from(*camera_count) * costs.sample_image_s;
        let loaded_s = cells * self.nodes.max(1) as f64 * costs.load_set_s;
        (sampled_s + loaded_s) / self.views_a_set.max(1) as f64 + costs.view_s
    }
}

/// The error of a row that is so many [doublings](Row::doublings_from) above another, over that of the other.
pub(crate) fn error_after(doublings: [f64; 3]) -> f64 {
    ERROR_OF_DOUBLING.into_iter().zip(doublings).map(|(error, times)| error.powf(times)).product()
}
