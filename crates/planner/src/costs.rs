//! Costs of a row, which nodes measure, and their price, which the caller knows.

use serde::{Deserialize, Serialize};

use crate::invalid::{InvalidField, seconds};
use crate::ladder::Row;

/// Costs of a row on one device, in s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RowCosts {
    /// g_s: one sample image, always in the light of the session.
    pub sample_image_s: f64,
    /// d: one sample set on a compositor.
    pub load_set_s: f64,
    /// c: one reconstructed view.
    pub reconstruct_view_s: f64,
}

impl RowCosts {
    /// # Errors
    /// For a cost that is not from 0 to 10⁶ s, by its field.
    pub fn validate(&self) -> Result<(), InvalidField> {
        seconds(self.sample_image_s, "sample_image_s")?;
        seconds(self.load_set_s, "load_set_s")?;
        seconds(self.reconstruct_view_s, "reconstruct_view_s")
    }
}

/// The price of serving a representation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// The nodes' time for a view, sampling and loading included, in s. The least is chosen.
    pub node_s: f64,
    /// The time of a view on the slowest node, reconstructing and encoding it, in s. A budget may limit it.
    pub view_s: f64,
}

/// The prices of representations. The cluster's come from its schedule, a study's from a cluster of one node. Equal
/// arguments give equal prices. A price is finite and at least 0 in both fields: a row with any other price is not chosen.
pub trait Pricing {
    /// The price of a row with these costs.
    fn row(&self, row: &Row, costs: &RowCosts) -> Price;
    /// The price of drawing every view directly. Where views may not be drawn directly it is not finite.
    fn direct(&self) -> Price;
}

/// The median of each cost.
#[must_use]
pub fn median_costs(costs: &[RowCosts]) -> RowCosts {
    let of = |cost: fn(&RowCosts) -> f64| median(costs.iter().map(cost).collect());
    RowCosts {
        sample_image_s: of(|costs| costs.sample_image_s),
        load_set_s: of(|costs| costs.load_set_s),
        reconstruct_view_s: of(|costs| costs.reconstruct_view_s),
    }
}

/// The median of numbers; 0 without any.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) / 2.0 }
}
