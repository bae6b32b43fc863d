//! The views on which rows are measured.

use serde::{Deserialize, Serialize};

use crate::random::unit;

/// The seed of common views; that of fresh ones is the number of their plan, from 1.
const COMMON_SEED: u64 = 0;

/// A view on which a row is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProbeView {
    /// One of the common views on which rows are compared.
    Common(u64),
    /// One that is drawn for the test of a choice, and that no row was compared on.
    Fresh(u64),
}

/// A place among all views that a promise is for. Every number is from 0 to below 1, and all numbers are equally likely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbePlace {
    /// Which of several view cells.
    pub cell: f64,
    /// Where in the cell the viewer stands, to the right, up and back.
    pub eye: [f64; 3],
    /// Which part of the view is compared, by column and row.
    pub part: [f64; 2],
}

/// One common view in so many is whole.
const WHOLE_EVERY: u64 = 4;

impl ProbeView {
    /// Whether the whole view is compared, and timed; else a part of it, chosen at random, which has the view's errors in the mean.
    #[must_use]
    pub fn is_whole(self) -> bool {
        matches!(self, Self::Common(number) if number % WHOLE_EVERY == 0)
    }

    /// The place of the view in the plan of a number.
    #[must_use]
    pub fn place(self, plan: u64) -> ProbePlace {
        let (seed, number) = match self {
            Self::Common(number) => (COMMON_SEED, number),
            Self::Fresh(number) => (plan, number),
        };
        let [cell, x, y, z, column, row] = [0, 1, 2, 3, 4, 5].map(|axis| unit(seed, number.wrapping_mul(6) + axis));
        ProbePlace { cell, eye: [x, y, z], part: [column, row] }
    }
}
