//! Charts, tables, pictures and checks of paths.

use report::{Axis, Bar, Cell, Check, Picture, PictureRow, Report, Series, Table, XyChart};

use super::figures::{CLASSES, Figures};
use super::measure::Measured;
use super::paths::Switch;
use crate::statistics::median;

/// The most that the error of the change at a switch may be, over that of the median frame.
const MOST_JUMP: f64 = 1.5;
/// Frames of a path that are shown, those with the greatest errors.
const WORST_FRAMES: usize = 3;

impl Measured {
    fn frames(&self) -> impl Iterator<Item = (usize, &Figures)> {
        (1..).zip(&self.figures)
    }

    /// The greatest error of a change at a switch, over the median of the changes without; `None` where either is missing.
    pub fn jump(&self) -> Option<f64> {
        Some(self.errors(true).into_iter().reduce(f64::max)? / self.usual()?)
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

    /// The median of the changes at switches, and the greatest without one, over the median of those without.
    fn median_jump_and_worst_other(&self) -> Option<[f64; 2]> {
        let (switches, usual) = (self.errors(true), self.usual()?);
        let median_jump = (!switches.is_empty()).then(|| median(switches))?;
        Some([median_jump / usual, self.errors(false).into_iter().reduce(f64::max)? / usual])
    }

    fn mean(&self, of: impl Fn(&Figures) -> f64) -> f64 {
        self.figures.iter().map(of).sum::<f64>() / self.figures.len().max(1) as f64
    }
}

/// Adds the table of all paths, a chart and the worst frames of each, and the checks.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_to(report: &mut Report, paths: &[Measured]) -> anyhow::Result<()> {
    report.tables.push(table(paths)?);
    for path in paths {
        report.charts.push(chart(path).into());
        report.pictures.extend(worst(path));
    }
    add_checks(report, paths);
    Ok(())
}

/// Adds a check of the jump of each path across cells.
pub fn add_checks(report: &mut Report, paths: &[Measured]) {
    for measured in paths.iter().filter(|measured| measured.path.kind.switch == Switch::Cell) {
        let name = format!("jump at a switch, {}", measured.path.kind.name);
        report.checks.push(Check::maybe(name, measured.jump(), "×", Bar::AtMost(MOST_JUMP), "no frame switches"));
    }
}

fn table(paths: &[Measured]) -> anyhow::Result<Table> {
    let columns = [
        ("path", ""),
        ("scene", ""),
        ("frames", ""),
        ("switches", ""),
        ("foreground FLIP, mean", ""),
        ("error of changes, mean", ""),
        ("error of changes, worst", ""),
        ("jump", "×"),
        ("median switch", "×"),
        ("worst other frame", "×"),
    ];
    let mut table = Table::new("Paths", &columns);
    for measured in paths {
        let path = &measured.path;
        let switches = (0..path.frames.len()).filter(|&frame| path.is_switch(frame)).count();
        let others = measured.median_jump_and_worst_other();
        let worst = measured.figures.iter().map(|figures| figures.change_error).fold(0.0, f64::max);
        table.push([
            Cell::from(path.kind.name),
            path.kind.scene.into(),
            path.frames.len().into(),
            switches.into(),
            measured.mean(|figures| figures.flip).into(),
            measured.mean(|figures| figures.change_error).into(),
            worst.into(),
            measured.jump().into(),
            others.map(|[median_jump, _]| median_jump).into(),
            others.map(|[_, worst_other]| worst_other).into(),
        ])?;
    }
    Ok(table)
}

fn chart(measured: &Measured) -> XyChart {
    let name = measured.path.kind.name;
    let error = Axis::linear("error of the change from the frame before", "of full scale");
    let mut chart = XyChart::new(format!("Error of changes, {name}"), Axis::linear("frame", ""), error);
    let points = |of: &dyn Fn(&Figures) -> Option<f64>| -> Vec<(f64, f64)> {
        measured.frames().filter_map(|(frame, figures)| Some((frame as f64, of(figures)?))).collect()
    };
    chart = chart.with(Series::line("foreground", points(&|figures| Some(figures.change_error))));
    for (place, (_, class)) in CLASSES.iter().enumerate() {
        chart = chart.with(Series::line(*class, points(&|figures| figures.change_error_by_class[place])));
    }
    let switches = measured.frames().filter(|(frame, _)| measured.path.is_switch(*frame));
    let switches: Vec<(f64, f64)> = switches.map(|(frame, figures)| (frame as f64, figures.change_error)).collect();
    if switches.is_empty() { chart } else { chart.with(Series::points("switch", switches)) }
}

/// The frames with the greatest errors, beside those before.
fn worst(measured: &Measured) -> Vec<PictureRow> {
    let mut frames: Vec<(usize, &Figures)> = measured.frames().collect();
    frames.sort_by(|a, b| b.1.change_error.total_cmp(&a.1.change_error));
    frames.truncate(WORST_FRAMES);
    let row = |(frame, figures): (usize, &Figures)| {
        let title = format!("{}, frame {frame}", measured.path.kind.name);
        let picture = |what: &str, image| Picture::new(format!("{title} {what}"), what, image);
        let before = pictures::rgb(&measured.views[frame - 1]).map(|image| picture("frame before", image));
        let view = pictures::rgb(&measured.views[frame]).map(|image| picture("frame", image));
        let truth = pictures::rgb(&measured.truths[frame]).map(|image| picture("drawn from the scene", image));
        let map = picture("error of the change", pictures::error_map(&figures.change_error_map));
        PictureRow {
            title: title.clone(),
            pictures: before.into_iter().chain(view).chain(truth).chain([map]).collect(),
        }
    };
    frames.into_iter().map(row).collect()
}
