//! The views on which rows are measured.

use std::array;

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
/// Steps of low-discrepancy sequences (Roberts 2018): of one dimension for the cell, of three for the eye, of two for the part. Few
/// views are spread evenly over the cell and the picture, most of which may show no surface.
const STEPS: [f64; 6] = [0.618_034, 0.819_173, 0.671_044, 0.549_701, 0.754_878, 0.569_840];

impl ProbeView {
    /// Whether the whole view is compared, and timed; else a part of it, chosen at random, which has the view's errors in the mean.
    #[must_use]
    pub fn is_whole(self) -> bool {
        matches!(self, Self::Common(number) if number % WHOLE_EVERY == 0)
    }

    /// The place of the view in the plan of a number, which moves the whole sequence: every place is equally likely.
    #[must_use]
    pub fn place(self, plan: u64) -> ProbePlace {
        let (seed, number) = match self {
            Self::Common(number) => (COMMON_SEED, number),
            Self::Fresh(number) => (plan, number),
        };
        let [cell, x, y, z, column, row] =
            array::from_fn(|axis| (unit(seed, axis as u64) + number as f64 * STEPS[axis]).fract());
        ProbePlace { cell, eye: [x, y, z], part: [column, row] }
    }
}
