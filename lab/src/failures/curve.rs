//! A curve: values over a quantity, and the shapes that they must have.

use anyhow::ensure;

use super::shape::{Shape, Violation};
use super::stand::Stand;

/// A quantity along the horizontal axis, and the values at which it is measured.
#[derive(Debug, Clone, Copy)]
pub struct X {
    pub label: &'static str,
    pub unit: &'static str,
    /// Equal ratios have equal distances in the chart.
    pub is_log: bool,
    /// In the study.
    pub values: &'static [f64],
    /// In tests, and in the study's smaller form.
    pub small: &'static [f64],
}

impl X {
    pub const fn linear(label: &'static str, unit: &'static str, values: &'static [f64]) -> Self {
        Self { label, unit, is_log: false, values, small: values }
    }

    pub const fn log(label: &'static str, unit: &'static str, values: &'static [f64]) -> Self {
        Self { is_log: true, ..Self::linear(label, unit, values) }
    }

    /// With fewer values in tests.
    pub const fn with_small(self, small: &'static [f64]) -> Self {
        Self { small, ..self }
    }
}

/// Values under one name, and the shapes that they must have, all of them.
#[derive(Debug, Clone, Copy)]
pub struct Series {
    pub name: &'static str,
    pub shapes: &'static [Shape],
}

impl Series {
    pub const fn new(name: &'static str, shapes: &'static [Shape]) -> Self {
        Self { name, shapes }
    }
}

/// A failure of a method as data: what is measured over what, which shape it has, and why.
#[derive(Clone, Copy)]
pub struct Curve {
    pub name: &'static str,
    /// The scene, and what is done to it.
    pub subject: &'static str,
    pub x: X,
    /// Quantity and unit of all series.
    pub y: [&'static str; 2],
    pub series: &'static [Series],
    pub why: &'static str,
    /// A row for each x, in which each series has a value.
    pub measure: fn(&Stand, &[f64]) -> anyhow::Result<Rows>,
}

/// The quantity of curves of picture errors.
pub const FLIP: [&str; 2] = ["FLIP of the foreground", ""];

/// A row for each x, in which each series has a value.
pub type Rows = Vec<Vec<f64>>;

/// The values of a curve.
#[derive(Debug, Clone)]
pub struct Measured {
    pub x: Vec<f64>,
    /// Of each series.
    pub ys: Vec<Vec<f64>>,
}

impl Curve {
    /// Measures the curve at the stand's size.
    ///
    /// # Errors
    /// The device's, or a row that does not have a value for each series.
    pub fn measured(&self, stand: &Stand) -> anyhow::Result<Measured> {
        let x = if stand.is_small { self.x.small } else { self.x.values };
        let rows = (self.measure)(stand, x)?;
        ensure!(rows.len() == x.len(), "{}: {} rows for {} values of x", self.name, rows.len(), x.len());
        let wrong = rows.iter().find(|row| row.len() != self.series.len());
        ensure!(wrong.is_none(), "{}: a row of {wrong:?} for {} series", self.name, self.series.len());
        let ys = (0..self.series.len()).map(|series| rows.iter().map(|row| row[series]).collect()).collect();
        Ok(Measured { x: x.to_vec(), ys })
    }

    /// The first violation of each series; `None` where it has all of its shapes.
    pub fn violations<'c>(&'c self, measured: &'c Measured) -> impl Iterator<Item = Option<Violation>> + 'c {
        self.series
            .iter()
            .zip(&measured.ys)
            .map(|(series, y)| series.shapes.iter().find_map(|shape| shape.check(&measured.x, y).err()))
    }
}

/// Rows of one function of x.
///
/// # Errors
/// The first one's.
pub fn rows<const N: usize>(x: &[f64], of: impl FnMut(f64) -> anyhow::Result<[f64; N]>) -> anyhow::Result<Rows> {
    x.iter().copied().map(of).map(|row| Ok(row?.to_vec())).collect()
}
