//! The views on which rows are measured.

use serde::{Deserialize, Serialize};

use crate::random::unit;

/// 1/g, 1/g² and 1/g³ for g⁴ = g + 1: the additive recurrence of lowest discrepancy in three dimensions (Roberts 2018, "The
/// unreasonable effectiveness of quasirandom sequences").
const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];

/// A view on which a row is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProbeView {
    /// One of the common views on which all rows are compared.
    Screening(u32),
    /// One that is drawn at random for certificates, and that no plan has seen before.
    Fresh(u64),
}

impl ProbeView {
    /// The place of the view among the viewpoints that are planned for, three numbers from 0 to below 1. The caller's mapping
    /// from places to cameras, with equally likely places, is the distribution of views for which a promise is made.
    #[must_use]
    pub fn place(self, seed: u64) -> [f64; 3] {
        match self {
            Self::Screening(number) => STEPS.map(|step| (0.5 + step * (f64::from(number) + 1.0)).fract()),
            Self::Fresh(number) => [0, 1, 2].map(|axis| unit(seed, number.wrapping_mul(3).wrapping_add(axis))),
        }
    }
}
