//! The views on which rows are measured.

use serde::{Deserialize, Serialize};

use crate::random::unit;

/// Bases of the Halton sequence (Halton 1960), whose places are even on each axis and together.
const BASES: [u64; 3] = [2, 3, 5];

/// A view on which a row is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
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
            Self::Screening(number) => BASES.map(|base| radical_inverse(u64::from(number) + 1, base)),
            Self::Fresh(number) => [0, 1, 2].map(|axis| unit(seed, number.wrapping_mul(3).wrapping_add(axis))),
        }
    }
}

/// The digits of a number in a base, mirrored at the point.
fn radical_inverse(mut number: u64, base: u64) -> f64 {
    let mut inverse = 0.0;
    let mut digit = 1.0;
    while number > 0 {
        digit /= base as f64;
        inverse += digit * (number % base) as f64;
        number /= base;
    }
    inverse
}
