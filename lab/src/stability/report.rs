//! The table and the charts of paths.

use report::{Axis, Report, Series, XyChart};

use super::figures::Figures;
use super::measure::Measured;
use crate::statistics::median;
use crate::study::{Column, table};

const COLUMNS: [Column<Measured>; 10] = [
    Column::new("path", |path| path.path.kind.name.into()),
    Column::new("scene", |path| path.path.kind.scene.into()),
    Column::new("frames", |path| path.path.frames.len().into()),
    Column::new("switches", |path| path.path.switches().into()),
    Column::new("foreground FLIP, mean", |path| path.mean(|figures| figures.flip).into()),
    Column::new("error of changes, mean", |path| path.mean(|figures| figures.change_error).into()),
    Column::new("error of changes, worst", |path| path.worst().into()),
    Column::with_unit("jump", "×", |path| path.jump().into()),
    Column::with_unit("median switch", "×", |path| path.median_jump().into()),
    Column::with_unit("worst other frame", "×", |path| path.worst_other().into()),
];

impl Measured {
    fn frames(&self) -> impl Iterator<Item = (usize, &Figures)> {
        (1..).zip(&self.figures)
    }

    fn worst(&self) -> f64 {
        self.figures.iter().map(|figures| figures.change_error).fold(0.0, f64::max)
    }

    /// The greatest error of a change at a switch, over the median of the changes without; `None` where either is missing.
    pub fn jump(&self) -> Option<f64> {
        Some(self.errors(true).into_iter().reduce(f64::max)? / self.usual()?)
    }

    /// As [`Self::jump`], for the median of the changes at switches.
    fn median_jump(&self) -> Option<f64> {
        let switches = self.errors(true);
        (!switches.is_empty()).then(|| median(switches)).zip(self.usual()).map(|(jump, usual)| jump / usual)
    }

    /// The greatest error of a change without a switch, over the median of those, on a path with switches.
    fn worst_other(&self) -> Option<f64> {
        let worst = self.errors(false).into_iter().reduce(f64::max)?;
        self.median_jump().and(self.usual()).map(|usual| worst / usual)
    }

    /// The errors of changes at switches, or without one.
    fn errors(&self, at_switch: bool) -> Vec<f64> {
        let wanted = self.frames().filter(|(frame, _)| self.path.is_switch(*frame) == at_switch);
        wanted.map(|(_, figures)| figures.change_error).collect()
    }

    /// The median of the changes without a switch.
    fn usual(&self) -> Option<f64> {
        let others = self.errors(false);
        (!others.is_empty()).then(|| median(others)).filter(|&usual| usual > 0.0)
    }

    fn mean(&self, of: impl Fn(&Figures) -> f64) -> f64 {
        self.figures.iter().map(of).sum::<f64>() / self.figures.len().max(1) as f64
    }

    fn chart(&self) -> XyChart {
        let title = format!("Error of changes, {}", self.path.kind.name);
        let error = Axis::linear("error of the change from the frame before", "of full scale");
        let all: Vec<(f64, f64)> = self.frames().map(|(frame, figures)| (frame as f64, figures.change_error)).collect();
        let switches: Vec<(f64, f64)> =
            (1..).zip(&all).filter(|(frame, _)| self.path.is_switch(*frame)).map(|(_, point)| *point).collect();
        let chart = XyChart::new(title, Axis::linear("frame", ""), error).with(Series::line("foreground", all));
        if switches.is_empty() { chart } else { chart.with(Series::points("switch", switches)) }
    }
}

/// Adds the table of all paths, and a chart of each.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_to(report: &mut Report, paths: &[Measured]) -> anyhow::Result<()> {
    report.tables.push(table("Paths", &COLUMNS, paths)?);
    report.charts.extend(paths.iter().map(|path| path.chart()));
    Ok(())
}
