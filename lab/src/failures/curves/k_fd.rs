//! The balance formula over loads, its edges included.

use coordinator::schedule::k_fd;

use crate::failures::curve::{Curve, Rows, Series, X, rows};
use crate::failures::shape::Shape;
use crate::failures::stand::Stand;

/// The load of sampling over that of reconstruction.
const LOADS: X =
    X::log("load of sampling / of views", "", &[1e-6, 1e-3, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 1e3, 1e6]);
const NODES: [usize; 4] = [2, 5, 16, 64];

pub const CURVES: [Curve; 2] = [
    Curve {
        name: "Sampling nodes against load",
        subject: "the formula for 2, 5, 16 and 64 nodes",
        x: LOADS,
        y: ["share of nodes that sample", ""],
        series: &[
            Series::new("P = 2", &[Shape::Plateau { tolerance: 0.0 }]),
            Series::new("P = 5", &[Shape::rises(0.5, 0.0)]),
            Series::new("P = 16", &[Shape::rises(0.8, 0.0)]),
            Series::new("P = 64", &[Shape::rises(0.9, 0.0), Shape::EqualAt { x: 1.0, y: 0.5, tolerance: 0.02 }]),
        ],
        why: "Nodes follow the load. One is left on either side, however small its load is.",
        measure: shares,
    },
    Curve {
        name: "Time of the formula's K over the best",
        subject: "max(a / K, b / (P − K)), every K tried",
        x: LOADS,
        y: ["time over the least", ""],
        series: &[
            Series::new("P = 2", BEST),
            Series::new("P = 5", BEST),
            Series::new("P = 16", BEST),
            Series::new("P = 64", BEST),
        ],
        why: "The optimum is ⌊K*⌋; the printed ⌈K*⌉ is a slip.",
        measure: over_the_best,
    },
];

const BEST: &[Shape] = &[Shape::Bounded { least: 1.0, most: 1.0 + 1e-12 }];

fn shares(_: &Stand, loads: &[f64]) -> anyhow::Result<Rows> {
    rows(loads, |load| Ok(NODES.map(|p| k_fd(1, load, 1, 1.0, p) as f64 / p as f64)))
}

fn over_the_best(_: &Stand, loads: &[f64]) -> anyhow::Result<Rows> {
    rows(loads, |load| {
        Ok(NODES.map(|p| {
            let time = |k: usize| (load / k as f64).max(1.0 / (p - k) as f64);
            let least = (1..p).map(time).min_by(f64::total_cmp).unwrap_or(f64::INFINITY);
            time(k_fd(1, load, 1, 1.0, p)) / least
        }))
    })
}
